"""The verdict of ``iveg robot check``, and its lines of text."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CheckRow:
    """One line of the table."""

    topic: str
    type: str
    writers: int
    rate_hz: float
    age_s: float | None
    remark: str


@dataclass(frozen=True, slots=True)
class CheckVerdict:
    """Result of a check; the robot may connect if ``missing`` is empty.

    Attributes:
        gate: Id of the robot whose gate runs already; empty: none does.
    """

    rows: tuple[CheckRow, ...]
    chain: str
    missing: tuple[str, ...]
    gate: str = ""


def lines(verdict: CheckVerdict) -> list[str]:
    """Text lines of the result."""
    table = [("topic", "type", "writers", "Hz", "age", "")]
    for row in verdict.rows:
        known = row.age_s is not None and math.isfinite(row.age_s)
        age = f"{row.age_s:.2f} s" if known else "-"
        rate = f"{row.rate_hz:.1f}"
        table.append((row.topic, row.type, str(row.writers), rate, age, row.remark))
    widths = [max(len(row[n]) for row in table) for n in range(len(table[0]))]
    said = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        for row in table
    ]
    said = [line.rstrip() for line in said]
    said += ["", f"TF: {verdict.chain}", ""]
    if verdict.gate:
        said += [f"The gate of {verdict.gate} is running.", ""]
    return said + (list(verdict.missing) or ["Nothing is missing."])
