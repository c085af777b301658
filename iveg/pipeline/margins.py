"""Margins beside the rule loop, twice a second: shown and never acted on."""

from iveg.domain.exposure import PERIOD_S, Exposures
from iveg.domain.limits import LIMITS
from iveg.domain.margins import LeastMargins, SafetyMargin
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.world import World


class MarginTotals:
    """For how long some margin was negative today, and the newest of each robot.

    Attributes:
        exposures: The totals.
    """

    def __init__(self, world: World, people: People) -> None:
        self.exposures = Exposures()
        self._world = world
        self._people = people
        self._newest: dict[str, float | None] = {}
        self._at: Instant | None = None

    def tick(self, now: Instant) -> None:
        """Let time pass; margins are computed when they are due."""
        if not self.exposures.due(now):
            return
        fleet = list(self._world.live_robots())
        least = LeastMargins(fleet, self._people.known.values(), now)
        margins = least.telling()
        self._at = now
        self._newest = {
            robot.robot_id: _measured(robot, least.of_robot(robot.robot_id))
            for robot in fleet
        }
        ages = [robot.age_s(now) for robot in fleet]
        seen = any(age is not None and age <= LIMITS.pose_lost_s for age in ages)
        self.exposures.update(margins, now, seen=seen)

    def of(self, robot_id: str, now: Instant) -> float | None:
        """The robot's least margin, at most a second old (m).

        None where nobody is near or it is unknown, and of a robot that stands.
        """
        if self._at is None or now.mono - self._at.mono > 2 * PERIOD_S:
            return None
        return self._newest.get(robot_id)


def _measured(robot: RobotState, margin: SafetyMargin | None) -> float | None:
    if margin is None or not margin.known or margin.age_s > LIMITS.seen_s:
        return None
    odometry = robot.odometry
    if odometry is None or abs(odometry.twist.linear_x) < LIMITS.standing_speed:
        return None
    return round(margin.margin_m, 2)
