"""Comparison of two results: better, worse, or undecided."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import fmean

from iveg.domain.errors import DataFileError
from iveg.domain.latency.account import Cell
from iveg.domain.latency.segments import DATA
from iveg.domain.records import Json
from iveg.lab.experiment.outcome import slices_of, timed_runs
from iveg.lab.experiment.paper_tables import CLASSES
from iveg.lab.experiment.plan import FORMAT, read_json
from iveg.lab.experiment.resampling import (
    Measure,
    Run,
    change,
    measures,
    protection_measures,
)
from iveg.lab.experiment.slices import HOPS, latency_changes, whole
from iveg.lab.experiment.statistics import Interval, difference, verdict

Result = Json
_OTHER_LOAD = "cannot tell: the machine had another load"


def read_result(place: Path) -> Result:
    """The result in an experiment's folder, or in a file.

    Raises:
        DataFileError: there is none, or it has the format of another version.
    """
    file = place
    if place.is_dir():
        whole_, partial = place / "result.json", place / "partial.json"
        file = whole_ if whole_.exists() or not partial.exists() else partial
    result: Result = read_json(file)
    if result.get("format") != FORMAT:
        reason = f"is not of format {FORMAT}: run it again with this version"
        raise DataFileError(str(file), "format", reason)
    return result


def write_comparison(before: Result, after: Result) -> str:
    """Text table with the 95 % interval of each difference."""
    lines = [f"{'what':<36}{'before':>12}{'after':>12}   difference (95 %)"]
    lines += _shares(before, after)
    lines += _counted(before, after)
    lines += _latencies(before, after)
    lines += (_load(name, of) for name, of in (("before", before), ("after", after)))
    if before["plan"] != after["plan"]:
        lines.append("The plans differ: so may what was counted.")
    return "\n".join(lines) + "\n"


def _shares(before: Result, after: Result) -> Iterator[str]:
    """Newcombe's interval, of Wilson's two (1998, method 10)."""
    for class_id in CLASSES:
        for rate in ("precision", "recall"):
            one = before["detection"][class_id][rate]
            other = after["detection"][class_id][rate]
            if one is not None and other is not None:
                pair = Interval(**one), Interval(**other)
                apart = difference(*pair)
                shares = pair[0].share, pair[1].share
                yield _line(f"{class_id} {rate}", *shares, apart, verdict(apart))


def _counted(before: Result, after: Result) -> Iterator[str]:
    """What robots did on the virtual clock, then in real time, then protection."""
    paired = before["plan"] == after["plan"]
    same_load = _same_load(before, after)
    for half, name in (("counted", ""), ("stack", ", real time")):
        old, new = ([run[half] for run in timed_runs(of)] for of in (before, after))
        may_tell = same_load or half == "counted"
        for measure in measures():
            yield from _changed(old, new, measure, name, paired, may_tell)
    old, new = map(_guarded, (before, after))
    for measure in protection_measures():
        yield from _changed(old, new, measure, "", paired, True)


def _guarded(result: Result) -> list[Run]:
    """Virtual halves by the rule as it stands, with the experiment's own detector."""
    own = {"profile": result["plan"]["profile"], "rule": "iveg", "fails": False}
    return [run["counted"] for run in result["runs"] if own.items() <= run.items()]


def _changed(
    old: Sequence[Run],
    new: Sequence[Run],
    measure: Measure,
    half: str,
    paired: bool,
    may_tell: bool,
) -> Iterator[str]:
    found = change(old, new, measure.of, paired=paired and len(old) == len(new))
    if found is None:
        return
    was, now, apart = found
    judged: str = verdict(_towards(apart, measure.better or 1.0))
    if not measure.better:
        judged = {"better": "more", "worse": "fewer"}.get(judged, judged)
    yield _line(
        f"{measure.name}{half}", was, now, apart, judged if may_tell else _OTHER_LOAD
    )


def _towards(apart: Interval, better: float) -> Interval:
    """A difference whose gain is positive."""
    low, high = sorted((better * apart.low, better * apart.high))
    return Interval(better * apart.share, low, high)


def _line(
    what: str, was: float, now: float, apart: Interval, judged: str, form: str = ".3f"
) -> str:
    between = f"{apart.low:{form}} to {apart.high:{form}}"
    return f"{what:<36}{was:>12{form}}{now:>12{form}}   {between}: {judged}"


def _latencies(before: Result, after: Result) -> Iterator[str]:
    """Bootstrapped intervals; a longer time is worse."""
    was, now = whole(slices_of(before)), whole(slices_of(after))
    runs = [
        [run["stack"]["slices"] for run in timed_runs(of)] for of in (before, after)
    ]
    same_load = _same_load(before, after)
    cells: list[Cell] = [(data, hop) for data in DATA for hop in HOPS]
    for cell in cells:
        for name, apart in latency_changes(runs[0], runs[1], cell):
            one, other = was[cell], now[cell]
            pair = one.mean, other.mean
            if name == "P95":
                pair = one.quantile(0.95), other.quantile(0.95)
            old, new = (1000.0 * (value or 0.0) for value in pair)
            judged = verdict(_towards(apart, -1.0)) if same_load else _OTHER_LOAD
            yield _line(f"{' '.join(cell)} {name} ms", old, new, apart, judged, ".2f")


def _loads(result: Result) -> list[float]:
    """Of each run's real half, the mean of before and after."""
    return [fmean(run["load"]) for run in timed_runs(result)]


def _same_load(before: Result, after: Result) -> bool:
    """Whether the loads of both overlap, or differ by less than one process."""
    old, new = _loads(before), _loads(after)
    if not old or not new:
        return False
    gap = max(min(new) - max(old), min(old) - max(new))
    return gap <= 0.0 or abs(fmean(new) - fmean(old)) < 1.0


def _load(name: str, result: Result) -> str:
    loads = _loads(result)
    if not loads:
        return f"Load of the machine {name}: unknown"
    between = f"{min(loads):.1f} to {max(loads):.1f}"
    cores = result["machine"]["cores"]
    return f"Load of the machine {name}: {fmean(loads):.1f} ({between}), {cores} cores"
