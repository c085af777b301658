"""Margins beside the rule loop, twice a second: kept with poses and never acted on."""

from iveg.domain.limits import LIMITS
from iveg.domain.margins import LeastMargins, SafetyMargin
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.world import World

_PERIOD_S = 0.5


class NewestMargins:
    """The newest margin of each robot, for charts."""

    def __init__(self, world: World, people: People) -> None:
        self._world = world
        self._people = people
        self._newest: dict[str, float | None] = {}
        self._at: Instant | None = None

    def tick(self, now: Instant) -> None:
        """Let time pass; margins are computed when they are due."""
        # Ticks come a little early; an evaluation must not wait for the one after.
        if self._at is not None and now.mono - self._at.mono < _PERIOD_S - 1e-3:
            return
        fleet = list(self._world.live_robots())
        least = LeastMargins(fleet, self._people.known.values(), now)
        self._at = now
        self._newest = {
            robot.robot_id: _measured(robot, least.of_robot(robot.robot_id))
            for robot in fleet
        }

    def of(self, robot_id: str, now: Instant) -> float | None:
        """The robot's least margin, at most a second old (m).

        None where nobody is near or it is unknown, and of a robot that stands.
        """
        if self._at is None or now.mono - self._at.mono > 2 * _PERIOD_S:
            return None
        return self._newest.get(robot_id)


def _measured(robot: RobotState, margin: SafetyMargin | None) -> float | None:
    if margin is None or not margin.known or margin.age_s > LIMITS.seen_s:
        return None
    if robot.odometry is None or robot.stands:
        return None
    return round(margin.margin_m, 2)
