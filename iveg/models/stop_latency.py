"""Times of the newest STOPs, and drills."""

from collections.abc import Iterable

from pydantic import Field

from iveg.domain.ranks import nearest_rank
from iveg.domain.transports import TransportId
from iveg.models.base import Model, rounded
from iveg.models.command import Command


class LatencySpread(Model):
    """Times of one step (ms); null where nothing was measured."""

    count: int
    p50_ms: float | None
    p95_ms: float | None
    max_ms: float | None

    @classmethod
    def of(cls, values: Iterable[float | None]) -> "LatencySpread":
        """Of measured times, to a tenth of a millisecond; missing ones do not count."""
        known = sorted(value for value in values if value is not None)
        return cls(
            count=len(known),
            p50_ms=rounded(nearest_rank(known, 0.50), 1),
            p95_ms=rounded(nearest_rank(known, 0.95), 1),
            max_ms=rounded(nearest_rank(known, 1.0), 1),
        )


class RobotLatency(Model):
    """One robot's STOPs: how many, and each step from the press on."""

    robot_id: str
    stops: int
    accepted: LatencySpread
    sent: dict[TransportId, LatencySpread] = Field(
        description=(
            "By transport, until it left; ``answer`` until the robot said that it has"
            " it."
        )
    )
    answer: dict[TransportId, LatencySpread]
    standing: LatencySpread


class Latency(Model):
    """Times of the newest STOPs of a range."""

    since: str
    until: str
    robots: list[RobotLatency]


class Drill(Model):
    """One drill and its verdict."""

    robot_id: str
    command_id: str
    drilled_at: str
    by: str
    passed: bool | None = Field(
        description="Standing in time; null while it may still come true."
    )
    standstill_ms: float | None
    command: Command
