"""Tables of the report: the paper's numbers beside the measured ones."""

from collections.abc import Iterator, Mapping, Sequence
from statistics import fmean
from typing import Final

from iveg.domain.latency.paper import PAPER, Place
from iveg.domain.latency.segments import Data
from iveg.domain.records import Json
from iveg.lab.experiment.cells import interval, ms
from iveg.lab.experiment.outcome import timed_runs
from iveg.lab.experiment.paper_tables import (
    CLASSES,
    COMPLETION,
    CONFIDENCE,
    GLOBAL,
    MEANS,
    P95_BELOW_MS,
    PRINTED,
    PaperScore,
    disagreements,
)
from iveg.lab.experiment.slices import HOPS

Result = Json
Rows = Iterator[Sequence[object]]

DETECTION: Final = ("class", "source", "TP", "FP", "FN", "precision", "recall", "AP")


def detection(result: Result) -> Rows:
    """Per class, in total and in the mean."""
    real = result["stack"]
    for class_id in CLASSES:
        yield _counts(class_id, "here", result["detection"][class_id])
        yield _counts(class_id, "here, real time", real["detection"][class_id])
        for place, rows in PRINTED.items():
            yield _printed(class_id, place, rows[class_id])
    yield _counts("total", "here", result["global"])
    yield _counts("total", "here, real time", real["global"])
    for place, row in GLOBAL.items():
        yield _printed("total", place, row)
    yield _means(result)
    for place, (precision, recall, ap) in MEANS.items():
        rates = (f"{precision:.2f} %", f"{recall:.2f} %")
        yield "mean", f"paper, {place}", "", "", "", *rates, ap


def _printed(name: str, place: Place, row: PaperScore) -> Sequence[object]:
    """A row of the paper's table."""
    rates = (f"{row.precision:.2f} %", f"{row.recall:.2f} %")
    ap = "–" if row.ap is None else row.ap
    return name, f"paper, {place}", row.tp, row.fp, row.fn, *rates, ap


def _counts(name: str, source: str, score: Json) -> Sequence[object]:
    ap = "–" if score["ap"] is None else f"{score['ap']:.2f}"
    rates = (interval(score["precision"]), interval(score["recall"]))
    return name, source, score["tp"], score["fp"], score["fn"], *rates, ap


def _means(result: Result) -> Sequence[object]:
    rows = [result["detection"][name] for name in CLASSES]
    cells = []
    for rate in ("precision", "recall"):
        shares = [row[rate]["share"] for row in rows if row[rate] is not None]
        cells.append(f"{100.0 * fmean(shares):.1f} %" if shares else "–")
    areas = [row["ap"] for row in rows if row["ap"] is not None]
    ap = f"{fmean(areas):.2f}" if areas else "–"
    return "mean", "here", "", "", "", *cells, ap


PLACE: Final = (
    *("class", "source", "n", "in the map, mean", "P95"),
    *("in the robot's frame, mean", "P95"),
)


def place(result: Result) -> Rows:
    """Distance of each correct detection from its target (m)."""
    for source, half in (("here", result), ("here, real time", result["stack"])):
        for class_id in CLASSES:
            score = half["detection"][class_id]
            cells = [
                _metres(off, name)
                for off in (score["place"]["map"], score["place"]["robot"])
                for name in ("mean_m", "p95_m")
            ]
            yield class_id, source, score["tp"], *cells


def _metres(off: Mapping[str, float] | None, name: str) -> str:
    return "–" if off is None else f"{off[name]:.3f}"


DISAGREES: Final = ("row", "table", "number", "printed", "follows")


def disagreeing() -> Rows:
    """Numbers of the paper's tables that do not follow from those beside them."""
    for one in disagreements():
        yield one.row, one.place, one.what, f"{one.printed:g}", f"{one.follows:g}"


CLAIMS: Final = ("what the text says", "here", "paper, simulation", "paper, field")


def claims(result: Result) -> Rows:
    """Numbers of the paper's text."""
    done, real = result["completion"], result["stack"]["completion"]
    here = f"{done['completed']} of {done['runs']}"
    through = f"{real['completed']} of {real['runs']}"
    shares = [f"{COMPLETION[place]:.0%}" for place in PRINTED]
    yield "runs completed", f"{here}; through all programs {through}", *shares
    field = result["field"]
    tested = f"{field['completed']} of {field['runs']}"
    yield "runs completed of the field test with failures", tested, *shares
    confidence = result["global"]["confidence"]
    sure = [f"{CONFIDENCE[place]:.0%}" for place in PRINTED]
    yield "mean confidence", "–" if confidence is None else f"{confidence:.0%}", *sure
    yield "…of these at or above the rule's threshold", _confident(result), "", ""
    sent, lost, reordered = (
        sum(row["messages"].get(name, 0) for row in result["latency"]["rows"])
        for name in ("sent", "lost", "reordered")
    )
    yield "messages that never came out of Orion", f"{lost} of {sent}", "none", ""
    yield "messages that came out of Orion after a later one", f"{reordered}", "", ""
    read = result["stack"]["read"]
    skipped = "messages that iVeg's own reading of the broker skipped for newer ones"
    of = f"{read.get('skipped', 0)} of {read.get('passed', 0)}"
    yield skipped, of, "", ""
    below = [f"below {P95_BELOW_MS[place]:.0f} ms" for place in PRINTED]
    worst = worst_p95(result)
    yield "P95 from robot to Orion", "–" if worst is None else f"{worst:.1f} ms", *below


def _confident(result: Result) -> str:
    threshold = result["configuration"].get("confidence_threshold")
    tallies = (one["counted"]["classes"].values() for one in timed_runs(result))
    found = [sure for each in tallies for one in each for sure in one["found"]]
    if threshold is None or not found:
        return "–"
    return f"{sum(one >= threshold for one in found) / len(found):.0%} ({threshold})"


def worst_p95(result: Result) -> float | None:
    """Greatest P95 of a kind of data from robot to Orion (ms)."""
    hops = [row["hops"]["robot_orion"] for row in result["latency"]["rows"]]
    return max((one["p95_ms"] or 0.0 for one in hops), default=0.0) or None


STOPS: Final = ("robot", "robot's answer", "standing")


def stops(result: Result) -> Rows:
    """STOP of the fleet (ms since the request)."""
    for one in result["stack"]["stops"]:
        answered = ms(one["answer"]["direct"]["p50_ms"])
        yield one["robot_id"], answered, ms(one["standing"]["p50_ms"])


LATENCY: Final = (
    *("data", "source", "n", "Δt₁", "P95", "n", "Δt₂", "P95"),
    *("n", "total", "P95", "Orion first", "n", "Δt₃", "P95"),
)


def latency(result: Result) -> Rows:
    """The paper's table (ms)."""
    for one in result["latency"]["rows"]:
        data: Data = one["data"]
        up, on, total, decided = (
            (hop["count"], ms(hop["mean_ms"]), ms(hop["p95_ms"]))
            for hop in (one["hops"][name] for name in HOPS)
        )
        yield data, "here", *up, *on, *total, _first(one["messages"]), *decided
        for place, printed in PAPER.items():
            row = printed[data]
            yield (
                *(data, f"paper, {place}"),
                *("", ms(row.uplink_mean), ms(row.uplink_p95)),
                *("", ms(row.fiware_mean), ms(row.fiware_p95)),
                *("", ms(row.total_mean), ms(row.total_p95), "", "", "", ""),
            )


def _first(messages: Mapping[str, int]) -> str:
    """Share of the messages that were read at Orion before they were at the broker."""
    came = messages.get("sent", 0) - messages.get("lost", 0)
    return f"{messages['orion_first'] / came:.1%}" if came else "–"


RUNS: Final = (
    *("run", "scenario", "seed", "pictures", "completed"),
    *("in real time", "completed", "Orion kept up", "load before", "after"),
)


def runs(result: Result) -> Rows:
    """One line per run."""
    for one in timed_runs(result):
        cells = [
            cell
            for half in (one["counted"], one["stack"])
            for cell in (half["pictures"], "yes" if half["completed"] else "no")
        ]
        kept_up = "yes" if one["stack"]["settled"] else "no"
        yield one["number"], one["family"], one["seed"], *cells, kept_up, *one["load"]


FIELD_TESTS: Final = ("run", "detector", "seed", "completed", "failed by")


def field_tests(result: Result) -> Rows:
    """One line per field test."""
    for one in result["runs"]:
        if one["fails"]:
            half = one["counted"]
            done = "yes" if half["completed"] else "no"
            why = ", ".join(half["failures"]) or "–"
            yield one["number"], one["profile"], one["seed"], done, why
