"""Margins beside the rule loop, twice a second: kept with poses and never acted on."""

from iveg.domain.limits import LIMITS
from iveg.domain.margins import LeastMargins, SafetyMargin
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.vital.core import Core

_PERIOD_S = 0.5


class NewestMargins:
    """Computes the margin of each robot, for charts."""

    def __init__(self, core: Core) -> None:
        self._world, self._people = core.world, core.people
        self._event_log = core.event_log
        self._at = float("-inf")

    def tick(self, now: Instant) -> None:
        """Let time pass; margins are computed when they are due."""
        # Ticks come a little early; an evaluation must not wait for the one after.
        if now.mono - self._at < _PERIOD_S - 1e-3:
            return
        # No pose is kept with a margin of before, should this fail.
        self._event_log.margins = {}
        fleet = list(self._world.live_robots())
        least = LeastMargins(fleet, self._people.known.values(), now)
        self._at = now.mono
        self._event_log.margins = {
            robot.robot_id: _measured(robot, least.of_robot(robot.robot_id))
            for robot in fleet
        }


def _measured(robot: RobotState, margin: SafetyMargin | None) -> float | None:
    """Least margin (m); None where nobody is near or known, or a robot stands."""
    if margin is None or not margin.known or margin.age_s > LIMITS.seen_s:
        return None
    if robot.odometry is None or robot.stands:
        return None
    return round(margin.margin_m, 2)
