"""Two results beside each other: better, worse, or nobody can tell."""

from collections.abc import Iterator, Mapping
from typing import Any

from iveg.experiment.paper_tables import CLASSES
from iveg.experiment.statistics import Interval, difference, verdict

Result = Mapping[str, Any]


def write_comparison(before: Result, after: Result) -> str:
    """As a table of text: rates with the 95 % interval of their difference."""
    lines = [f"{'what':<28}{'before':>10}{'after':>10}   difference (95 %)"]
    for what, one, other in _rates(before, after):
        apart = difference(one, other)
        told = f"{_percent(apart.low)} to {_percent(apart.high)}: {verdict(apart)}"
        shares = f"{_percent(one.share):>10}{_percent(other.share):>10}"
        lines.append(f"{what:<28}{shares}   {told}")
    lines += _latencies(before, after)
    return "\n".join(lines) + "\n"


def _rates(before: Result, after: Result) -> Iterator[tuple[str, Interval, Interval]]:
    for class_id in CLASSES:
        for rate in ("precision", "recall"):
            one = before["detection"][class_id][rate]
            other = after["detection"][class_id][rate]
            if one is not None and other is not None:
                yield f"{class_id} {rate}", Interval(**one), Interval(**other)


def _latencies(before: Result, after: Result) -> Iterator[str]:
    """Means and P95 as they are: messages follow each other too closely to test."""
    old, new = _means(before), _means(after)
    for name, (mean, p95) in old.items():
        if name in new:
            was, now = f"{mean:.1f}/{p95:.1f}", f"{new[name][0]:.1f}/{new[name][1]:.1f}"
            yield f"{name + ' ms':<28}{was:>10}{now:>10}   mean/P95"


def _means(result: Result) -> dict[str, tuple[float, float]]:
    rows = result.get("latency", {}).get("rows", [])
    return {
        f"{row['data']} {hop}": (told["mean_ms"], told["p95_ms"])
        for row in rows
        for hop, told in row["hops"].items()
        if told["count"]
    }


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"
