"""Comparison of two results: better, worse, or undecided."""

from collections.abc import Iterator, Mapping
from typing import Any

from iveg.domain.errors import DataFileError
from iveg.domain.latency.account import Cell
from iveg.domain.latency.segments import DATA
from iveg.lab.experiment.outcome import slices_of
from iveg.lab.experiment.paper_tables import CLASSES
from iveg.lab.experiment.plan import FORMAT
from iveg.lab.experiment.slices import HOPS, latency_changes, whole
from iveg.lab.experiment.statistics import Interval, difference, verdict

Result = Mapping[str, Any]


def write_comparison(before: Result, after: Result) -> str:
    """Text table with the 95 % interval of each difference.

    Raises:
        DataFileError: a result has the format of another version.
    """
    for result in (before, after):
        if result.get("format") != FORMAT:
            reason = f"is not of format {FORMAT}: run it again with this version"
            raise DataFileError("result.json", "format", reason)
    lines = [f"{'what':<28}{'before':>12}{'after':>12}   difference (95 %)"]
    lines += _shares(before, after)
    lines += _latencies(before, after)
    if before["plan"] != after["plan"]:
        lines.append("The plans differ: so may what was counted.")
    return "\n".join(lines) + "\n"


def _shares(before: Result, after: Result) -> Iterator[str]:
    """Newcombe's interval, of Wilson's two (1998, method 10)."""
    for what, one, other in _rates(before, after):
        apart_ = difference(one, other)
        told = f"{_percent(apart_.low)} to {_percent(apart_.high)}: {verdict(apart_)}"
        shares = f"{_percent(one.share):>12}{_percent(other.share):>12}"
        yield f"{what:<28}{shares}   {told}"


def _rates(before: Result, after: Result) -> Iterator[tuple[str, Interval, Interval]]:
    for class_id in CLASSES:
        for rate in ("precision", "recall"):
            one = before["detection"][class_id][rate]
            other = after["detection"][class_id][rate]
            if one is not None and other is not None:
                yield f"{class_id} {rate}", Interval(**one), Interval(**other)


def _latencies(before: Result, after: Result) -> Iterator[str]:
    """Bootstrapped intervals; a longer time is worse."""
    old, new = slices_of(before), slices_of(after)
    was, now = whole(old), whole(new)
    cells: list[Cell] = [(data, hop) for data in DATA for hop in HOPS]
    for cell in cells:
        for name, between in latency_changes(old, new, cell):
            one, other = was[cell], now[cell]
            pair = one.mean, other.mean
            if name == "P95":
                pair = one.quantile(0.95), other.quantile(0.95)
            shown = "".join(f"{1000.0 * (value or 0.0):>12.2f}" for value in pair)
            better = Interval(-between.share, -between.high, -between.low)
            told = f"{between.low:.2f} to {between.high:.2f}: {verdict(better)}"
            yield f"{' '.join(cell)} {name} ms".ljust(28) + f"{shown}   {told}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"
