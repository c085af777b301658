"""How long the history keeps what, and the moments before which rows may go.

Horizons are counted by the days that iVeg recorded, not by the clock alone.  A gap
between two of them counts for three days at most: a clock that is wrong by years takes
three days of what is kept and no more (docs/decisions/0006-days-that-were-recorded.md).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

DAY_S = 86400.0
GAP_DAYS = 3
"""A longer gap between two recorded days counts as this: a weekend counts in full."""
SPARED_DAYS = GAP_DAYS + 1
"""A full disk takes no telemetry of the newest days, so many of them."""

RetentionKind = Literal["positions", "telemetry", "decisions", "audit"]
Cutoffs = Mapping[RetentionKind, float]
"""Kind → the moment before which its rows may go (Unix s); kept for ever: none."""


@dataclass(frozen=True, slots=True)
class PurgeStep:
    """One kind of row of one table: ``positions`` lose their places, others go."""

    kind: RetentionKind
    table: str


PURGE_STEPS = (
    PurgeStep("positions", "detections"),
    PurgeStep("positions", "decisions"),
    PurgeStep("positions", "log"),
    PurgeStep("telemetry", "odometry"),
    PurgeStep("telemetry", "detections"),
    PurgeStep("telemetry", "climate"),
    PurgeStep("telemetry", "readings"),
    PurgeStep("telemetry", "measurements"),
    PurgeStep("decisions", "decisions"),
    PurgeStep("decisions", "commands"),
    PurgeStep("decisions", "alerts"),
    PurgeStep("decisions", "log"),
    PurgeStep("audit", "command_events"),
    PurgeStep("audit", "audit"),
)
"""In this order; docs/deployment.md, "How long the history keeps what"."""


@dataclass(frozen=True)
class Retention:
    """Days that each kind of row is kept; 0: for ever.

    Attributes:
        positions: Until people's places go from detections, decisions and log.
        telemetry: Of odometry, detections, climate, readings and measurements.
        decisions: Of decisions, commands, alerts and log.
        audit: Of the audit, by whole days, and of the steps of commands.
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
        days: dict[RetentionKind, int] = {
            "positions": self.positions,
            "telemetry": self.telemetry,
            "decisions": self.decisions,
            "audit": self.audit,
        }
        return {
            kind: cutoff(horizon, now, recorded)
            for kind, horizon in days.items()
            if horizon > 0 and recorded
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
    for day in (one for one in recorded if one < first):
        counts = min(first - day, GAP_DAYS)
        if left <= counts:
            return min(now - days * DAY_S, (day + counts - left) * DAY_S)
        first, left = day, left - counts
    # Before the oldest line nobody knows which days were recorded: all of them.
    return min(now - days * DAY_S, (first - left) * DAY_S)


def squeezed(
    cutoffs: Cutoffs, oldest: float | None, now: float, recorded: Sequence[int]
) -> Cutoffs:
    """The same where the disk is full: the oldest day of telemetry may go, too.

    Args:
        cutoffs: Of the retention alone.
        oldest: The oldest row of telemetry (Unix s); None where there is none.
        now: The wall clock (Unix s).
        recorded: As for ``Retention.cutoffs``.
    """
    if oldest is None or not recorded:
        return cutoffs
    may_go = min(oldest + DAY_S, cutoff(SPARED_DAYS, now, recorded))
    return {**cutoffs, "telemetry": max(may_go, cutoffs.get("telemetry", may_go))}
