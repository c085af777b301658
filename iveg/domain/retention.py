"""Horizons of the history, and room on its disk.

Horizons count the days that iVeg recorded, not the clock alone.  A gap between two of
them counts for three days at most: a clock that is wrong by years costs three days of
the history (docs/decisions/0006-days-that-were-recorded.md).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from iveg.domain.events import Condition

LEAST_BYTES, LEAST_SHARE = 10**9, 0.05
"""Free space (bytes, share of the disk) below the lesser of which the disk is low."""
WELL_AGAIN = 1.2
"""Ratio to that space at which a low disk is well again."""
LEAST_TO_RECORD, RECORDS_AGAIN = 20 * 10**9, 21 * 10**9
"""Free space below which recordings pause, and at which they go on (bytes)."""


@dataclass(frozen=True, slots=True)
class DiskSpace:
    """Room on the disk that holds the data (bytes).

    Attributes:
        free: Space that iVeg's user may take.
        total: Size of the file system.
    """

    free: int
    total: int

    @property
    def least(self) -> float:
        """Free space below which the disk is low (bytes)."""
        return min(LEAST_BYTES, LEAST_SHARE * self.total)

    def is_low(self, *, was_low: bool) -> bool:
        """Whether the disk is low; a low disk stays so until ``WELL_AGAIN``."""
        return self.free < self.least * (WELL_AGAIN if was_low else 1.0)

    def is_short(self, *, was_short: bool) -> bool:
        """Whether recordings pause; any low disk is short, too."""
        return self.free < (RECORDS_AGAIN if was_short else LEAST_TO_RECORD)

    def conditions(self, *, is_low: bool, is_paused: bool) -> Iterable[Condition]:
        """A P2 while the disk is low, a P3 while recordings pause."""
        if is_low:
            yield Condition.filled(
                "P2",
                "alert.disk_low",
                "disk",
                free_mb=self.free // 10**6,
                least_mb=int(self.least) // 10**6,
            )
        if is_paused:
            yield Condition.filled(
                "P3",
                "alert.recordings_paused",
                "disk",
                free_gb=self.free // 10**9,
            )


DAY_S = 86400.0
GAP_DAYS = 3
"""Greatest count of a gap between recorded days: a weekend counts in full."""

RetentionKind = Literal["positions", "telemetry", "decisions", "audit"]
Cutoffs = Mapping[RetentionKind, float]
"""Time before which rows of a kind may go (Unix s); absent: kept for ever."""


@dataclass(frozen=True, slots=True)
class PurgeStep:
    """One table and kind: ``positions`` lose their places, other rows are deleted."""

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
"""Steps in their order; docs/deployment.md, "How long the history keeps what"."""


@dataclass(frozen=True)
class Retention:
    """Horizon of each kind of row (days); 0: kept for ever.

    Attributes:
        positions: Places of people in detections, decisions and log.
        telemetry: Odometry, detections, climate, readings and measurements.
        decisions: Decisions, commands, alerts and log.
        audit: The audit and the steps of commands.
    """

    positions: int = 7
    telemetry: int = 30
    decisions: int = 365
    audit: int = 400

    @property
    def longest(self) -> int:
        """Longest horizon (days)."""
        return max(self.positions, self.telemetry, self.decisions, self.audit)

    def cutoffs(self, now: float, recorded: Sequence[int]) -> Cutoffs:
        """Times before which rows may go.

        Args:
            now: Wall clock (Unix s).
            recorded: Days (UTC, since 1970) with a line in the log, newest first; as
                many as the longest horizon, or all.
        """
        # Without a recorded day nothing goes: an empty log proves no age.
        return {
            kind: cutoff(days, now, recorded)
            for kind in _PURGED
            if recorded and (days := getattr(self, kind)) > 0
        }


def cutoff(days: int, now: float, recorded: Sequence[int]) -> float:
    """Start of the last ``days`` that count and have passed (Unix s).

    Args:
        days: Number of days, at least 1.
        now: Wall clock (Unix s).
        recorded: Days with a line in the log, newest first.
    """
    first, remaining = int(now // DAY_S), days - 1
    # Days in the future come from a wrong clock: they count for nothing.
    for day in (day for day in recorded if day < first):
        counts = min(first - day, GAP_DAYS)
        if remaining <= counts:
            return min(now - days * DAY_S, (day + counts - remaining) * DAY_S)
        first, remaining = day, remaining - counts
    # Before the oldest line it is unknown which days were recorded: all count.
    return min(now - days * DAY_S, (first - remaining) * DAY_S)
