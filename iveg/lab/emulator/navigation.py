"""Navigation of an emulated robot: its own route, or a goal that somebody gave it.

A robot whose goal was taken away stands until it gets another; one that has returned
goes on with its own route.  A robot that turns on the spot finds its way on a grid; one
with a turning radius knows no way but its own route.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.goals import Goal
from iveg.domain.observations import Navigation, Origin
from iveg.lab.emulator.following import Follower
from iveg.lab.emulator.greenhouse import Disc, Scenery
from iveg.lab.emulator.scripts import RobotScript, Route, Station, route_of
from iveg.lab.emulator.ways import way_between
from iveg.robot.goals import NEAR_M

_STAYS_S = 3.0
"""How long a robot that has returned stands before it goes on (s)."""


class Navigator:
    """Follows a robot's route, or drives it to a goal.

    Args:
        profile: Body of the robot.
        script: Its own work.
    """

    def __init__(self, profile: RobotProfile, script: RobotScript) -> None:
        self._profile, self._script = profile, script
        self._goal: Goal | None = None
        self._there_at: float | None = None
        self._follower: Follower | None = self._own_work(script.start)

    def _own_work(self, pose: Pose2D) -> Follower:
        script = self._script
        stations = script.stations
        return Follower(self._profile, script.route(), pose, script.cruise, stations)

    def pursue(self, goal: Goal | None, pose: Pose2D, scenery: Scenery) -> bool:
        """Drive to a goal; None: give it up and stand.

        Returns:
            Whether a way there is known.
        """
        if goal is None:
            # On its own way again there is nothing to give up.
            if self._goal is not None:
                self._goal = self._follower = None
            return True
        follower = None
        if goal.kind != "pause":
            follower = self._way_to(goal, pose, scenery)
            if follower is None:
                return False
        self._goal, self._follower, self._there_at = goal, follower, None
        return True

    def _way_to(self, goal: Goal, pose: Pose2D, scenery: Scenery) -> Follower | None:
        """The way to a goal and its end there; None where none is known."""
        if self._profile.turning_radius > 0.0:
            route = self._script.route()
        else:
            place, half = (pose.x, pose.y), self._profile.width / 2
            corners = way_between(place, (goal.x, goal.y), scenery, half)
            if corners is None:
                return None
            route = _route_along(corners)
        x, y = _end_on(route, goal)
        if math.dist((x, y), (goal.x, goal.y)) >= NEAR_M:
            return None
        stop = Station(x, y, dwell_s=math.inf)
        return Follower(self._profile, route, pose, self._script.cruise, (stop,))

    def requested_twist(
        self, pose: Pose2D, now: float, discs: Sequence[Disc]
    ) -> Twist2D:
        """The twist that it requests; arguments are the ``Follower``'s."""
        if self._follower is None:
            return REST
        twist = self._follower.requested_twist(pose, now, discs)
        if self._goal is not None and self._follower.at_station:
            self._there_at = now if self._there_at is None else self._there_at
            is_over = now - self._there_at >= _STAYS_S
            if self._goal.kind == "return" and is_over:
                self._goal, self._follower = None, self._own_work(pose)
        return twist

    def intent(self, robot_id: str) -> Navigation:
        """Task, goal and path."""
        goal, follower = self._goal, self._follower
        if follower is None:
            return Navigation(robot_id, Origin(), "waiting")
        path = follower.path()
        task = "waiting" if follower.at_station else self._script.task
        intent = Navigation(robot_id, Origin(), task, path[-1], path)
        if goal is None:
            return intent
        return replace(
            intent,
            task="waiting" if follower.at_station else "goal",
            goal=(goal.x, goal.y),
        )


def _end_on(route: Route, goal: Goal) -> tuple[float, float]:
    """Where a robot that comes along a route stops for a goal (m).

    The last two points of an open one are its own ends, where followers turn round.
    """
    index, last = route.index_of(goal.x, goal.y), len(route.points) - 1
    if not route.closed:
        index = max(min(index, last - 2), min(2, last // 2))
    x, y = route.points[index]
    return float(x), float(y)


def _route_along(corners: Sequence[tuple[float, float]]) -> Route:
    """A way as a route; one that ends where it begins has a point of each."""
    if len(corners) == 1:
        x, y = corners[0]
        corners = (x, y), (x + 0.01, y)
    return route_of(corners, 0.0, closed=False)
