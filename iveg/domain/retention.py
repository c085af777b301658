"""Horizons of the history, and room on its disk: what is kept how long.

Horizons are counted by the days that iVeg recorded, not by the clock alone.  A gap
between two of them counts for three days at most: a clock that is wrong by years takes
three days of what is kept and no more (docs/decisions/0006-days-that-were-recorded.md).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from iveg.domain.events import Condition

LEAST_BYTES, LEAST_SHARE = 10**9, 0.05
"""Below the lesser of these the disk is low."""
WELL_AGAIN = 1.2
"""It is low until there is so many times that room."""


@dataclass(frozen=True, slots=True)
class DiskSpace:
    """Room on the disk that holds the data (bytes).

    Attributes:
        free: For iVeg's user.
        total: Of the file system.
    """

    free: int
    total: int

    @property
    def least(self) -> float:
        """Below this the disk is low (bytes)."""
        return min(LEAST_BYTES, LEAST_SHARE * self.total)

    def is_low(self, *, was_low: bool) -> bool:
        """Whether it is low now; what was low is so until it is well again."""
        return self.free < self.least * (WELL_AGAIN if was_low else 1.0)

    def conditions(self, *, was_low: bool) -> Iterable[Condition]:
        """A P2 while it is low."""
        if self.is_low(was_low=was_low):
            slots = {
                "free_mb": self.free // 10**6,
                "least_mb": int(self.least) // 10**6,
            }
            yield Condition("P2", "alert.disk_low", "disk", None, slots)


DAY_S = 86400.0
GAP_DAYS = 3
"""A longer gap between two recorded days counts as this: a weekend counts in full."""

RetentionKind = Literal["positions", "telemetry", "decisions", "audit"]
Cutoffs = Mapping[RetentionKind, float]
"""Kind → the moment before which its rows may go (Unix s); kept for ever: none."""


@dataclass(frozen=True, slots=True)
class PurgeStep:
    """One kind of row of one table: ``positions`` lose their places, others go."""

    kind: RetentionKind
    table: str


_PURGED: Mapping[RetentionKind, Sequence[str]] = {
    "positions": ("detections", "decisions", "log"),
    "telemetry": ("odometry", "detections", "climate", "readings", "measurements"),
    "decisions": ("decisions", "commands", "alerts", "log"),
    "audit": ("command_events", "audit"),
}
PURGE_STEPS = tuple(
    PurgeStep(kind, table) for kind, tables in _PURGED.items() for table in tables
)
"""In this order; docs/deployment.md, "How long the history keeps what"."""


@dataclass(frozen=True)
class Retention:
    """Days that each kind of row is kept; 0: for ever.

    Attributes:
        positions: Until people's places go from detections, decisions and log.
        telemetry: Of odometry, detections, climate, readings and measurements.
        decisions: Of decisions, commands, alerts and log.
        audit: Of the audit and of the steps of commands.
    """

    positions: int = 7
    telemetry: int = 30
    decisions: int = 365
    audit: int = 400

    @property
    def longest(self) -> int:
        """The longest of these horizons."""
        return max(self.positions, self.telemetry, self.decisions, self.audit)

    def cutoffs(self, now: float, recorded: Sequence[int]) -> Cutoffs:
        """The moments before which rows may go.

        Args:
            now: The wall clock (Unix s).
            recorded: Days (UTC, since 1970) with a line in the log, newest first; at
                least as many as the longest horizon, if there are.
        """
        return {
            kind: cutoff(days, now, recorded)
            for kind in _PURGED
            if recorded and (days := getattr(self, kind)) > 0
        }


def cutoff(days: int, now: float, recorded: Sequence[int]) -> float:
    """The moment since which this many days count, and have passed (Unix s).

    Args:
        days: At least 1.
        now: The wall clock (Unix s).
        recorded: Days with a line in the log, newest first.
    """
    first, left = int(now // DAY_S), days - 1
    # Days that are still to come are of a clock that was ahead.
    for day in (day for day in recorded if day < first):
        counts = min(first - day, GAP_DAYS)
        if left <= counts:
            return min(now - days * DAY_S, (day + counts - left) * DAY_S)
        first, left = day, left - counts
    # Before the oldest line nobody knows which days were recorded: all of them.
    return min(now - days * DAY_S, (first - left) * DAY_S)
