"""Crossings: one robot inside one ring, until it has been outside for long enough."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.rule.zones import Zone


@dataclass(frozen=True, slots=True)
class Crossing:
    """One robot inside one ring, from trigger to release.

    Attributes:
        zone: The nearest circle of the cause at trigger.
        distance_m: Now; ``entered_m`` at the trigger.
        outside_since: When it was first found outside (monotonic, s).
        already_slow: It was slowed for something else: no slow-down will be seen.
        ahead: It had judged this very zone itself and said so before.
        foretold_s: When it would reach the ring, at the trigger (s); None: it was
            inside.
        speeding_up: It had not reached the speed that it wanted, so half of that may
            be more than half of what it drove.
        in_sight: Whether the robot saw it itself, or had a line of sight to the centre
            at the trigger.
    """

    decision_id: str
    robot_id: str
    zone: Zone
    entered: Instant
    entered_m: float
    speed_before: float
    in_sight: bool
    distance_m: float
    already_slow: bool = False
    ahead: bool = False
    speeding_up: bool = False
    outside_since: float | None = None
    foretold_s: float | None = None

    def continued(self, depth_m: float, distance_m: float, now: Instant) -> "Crossing":
        """The same, still inside or so far outside by now (m)."""
        since = None
        if depth_m > LIMITS.release_beyond_m:
            since = self.outside_since or now.mono
        if distance_m == self.distance_m and since == self.outside_since:
            return self
        return self.later(distance_m, since)

    def later(self, distance_m: float, outside_since: float | None) -> "Crossing":
        """The same, from another place of the robot or of the circle.

        Spelled out, as ``dataclasses.replace`` takes three times as long, and each
        robot that moves is judged anew.
        """
        return Crossing(
            self.decision_id,
            self.robot_id,
            self.zone,
            self.entered,
            self.entered_m,
            self.speed_before,
            self.in_sight,
            distance_m,
            self.already_slow,
            self.ahead,
            self.speeding_up,
            outside_since,
            self.foretold_s,
        )


@dataclass(frozen=True, slots=True)
class LimitChange:
    """A crossing that began or ended."""

    crossing: Crossing
    began: bool


def leave(
    mine: dict[str, Crossing], near: Mapping[str, object], now: Instant
) -> Iterator[LimitChange]:
    """The crossings that end, of robots that have been outside for long enough.

    Args:
        mine: Of one robot, by cause; those that end go from it.
        near: Causes whose rings it is near.
        now: This moment.
    """
    for cause, crossing in list(mine.items()):
        if cause not in near and crossing.outside_since is None:
            crossing = crossing.later(crossing.distance_m, now.mono)
            mine[cause] = crossing
        since = crossing.outside_since
        if since is not None and now.mono - since >= LIMITS.release_after_s:
            del mine[cause]
            yield LimitChange(crossing, began=False)
