"""Navigation: pure pursuit along a route, halts at stations, waiting for others.

Source: pure pursuit (Coulter, CMU-RI-TR-92-01).  A robot that cannot turn on the spot
drives an open route forwards and backwards.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Twist2D, wrap_angle
from iveg.lab.emulator.greenhouse import Disc, Floats
from iveg.lab.emulator.kinematics import clip
from iveg.lab.emulator.scripts import SPACING_M, Route, Station

_LOOK_AHEAD_M = 0.7
_WINDOW = 12
"""Points of the route that are searched for the robot's position at each tick."""
_ON_THE_SPOT = 0.9
"""Angle to the route from which a differential robot turns on the spot (rad)."""
_COMFORT = 0.4
"""Deceleration that navigation plans (m/s²)."""
CLEARANCE_M = 0.6
"""Free distance ahead of the robot's front below which it waits (m)."""
_SIDE_M = 0.15
_HORIZON = 35


class Follower:
    """Drives one vehicle along its route: pure pursuit, stations, and waiting.

    A robot that cannot turn on the spot follows an open route forwards and backwards.
    """

    def __init__(
        self,
        profile: RobotProfile,
        route: Route,
        start: Pose2D,
        cruise: float,
        stations: Iterable[Station] = (),
    ) -> None:
        self._profile = profile
        self._route = route
        self._cruise = min(cruise, profile.max_speed)
        self._stations = {route.index_of(s.x, s.y): s for s in stations}
        self._index = route.index_of(start.x, start.y)
        self._direction = 1
        self._leaves_at: float | None = None

    @property
    def at_station(self) -> bool:
        """Whether the robot halts at a station."""
        return self._leaves_at is not None

    def path(self, length_m: float = 12.0) -> tuple[tuple[float, float], ...]:
        """The path ahead, one point per metre."""
        count = round(length_m / SPACING_M)
        ahead = self._route.ahead(self._index, count, self._direction)
        return tuple((float(x), float(y)) for x, y in ahead[::10])

    def requested_twist(
        self, pose: Pose2D, now: float, discs: Sequence[Disc]
    ) -> Twist2D:
        """The twist that navigation requests.

        Args:
            pose: Pose of the robot.
            now: Seconds into the run.
            discs: People and parts of other robots, as local sensors detect them.
        """
        self._locate(pose)
        if self._halts(now):
            return Twist2D(0.0, 0.0)
        ahead = self._route.ahead(self._index, _HORIZON, self._direction)
        room = min(self._room(ahead, discs), self._way_to_halt() + CLEARANCE_M)
        limit = math.sqrt(2.0 * _COMFORT * max(0.0, room - CLEARANCE_M))
        return self._pursue(pose, ahead, min(self._cruise, limit))

    def _locate(self, pose: Pose2D) -> None:
        window = self._route.ahead(self._index, _WINDOW, self._direction)
        away = np.hypot(window[:, 0] - pose.x, window[:, 1] - pose.y)
        passed = int(away.argmin())
        index = self._index
        for _ in range(passed):
            index = index + self._direction
            if index % len(self._route.points) in self._stations:
                break
        self._index = index % len(self._route.points)

    def _halts(self, now: float) -> bool:
        if self._leaves_at is None:
            station = self._stations.get(self._index)
            at_end = not self._route.closed and self._way_to_end() <= 2
            if station is None and not at_end:
                return False
            station = station or Station(0.0, 0.0, dwell_s=2.0)
            self._leaves_at = station.departure(now)
        if now < self._leaves_at:
            return True
        self._leaves_at = None
        if not self._route.closed and self._way_to_end() <= 2:
            self._direction = -self._direction
        self._index = (self._index + 3 * self._direction) % len(self._route.points)
        return False

    def _way_to_end(self) -> int:
        last = len(self._route.points) - 1
        return last - self._index if self._direction > 0 else self._index

    def _way_to_halt(self) -> float:
        """Distance to the next station or end within the horizon (m)."""
        count = len(self._route.points)
        for step in range(_HORIZON):
            index = self._index + step * self._direction
            ended = not self._route.closed and step >= self._way_to_end()
            if ended or index % count in self._stations:
                return step * SPACING_M
        return math.inf

    def _room(self, ahead: Floats, discs: Sequence[Disc]) -> float:
        """Free distance ahead of the robot's front (m)."""
        if not discs:
            return math.inf
        half = self._profile.width / 2 + _SIDE_M
        places = np.array([(disc.x, disc.y, disc.radius) for disc in discs])
        dx = ahead[:, 0:1] - places[:, 0]
        dy = ahead[:, 1:2] - places[:, 1]
        blocked = (np.hypot(dx, dy) < half + places[:, 2]).any(axis=1)
        if not blocked.any():
            return math.inf
        way = int(blocked.argmax()) * SPACING_M
        return max(0.0, way + half - self._profile.length / 2)

    def _pursue(self, pose: Pose2D, ahead: Floats, speed: float) -> Twist2D:
        reach = min(round(_LOOK_AHEAD_M / SPACING_M), len(ahead) - 1)
        x, y = ahead[reach]
        backwards = self._direction < 0 and self._profile.turning_radius > 0.0
        heading = pose.yaw + math.pi if backwards else pose.yaw
        aside = wrap_angle(math.atan2(y - pose.y, x - pose.x) - heading)
        if self._profile.turning_radius == 0.0 and abs(aside) > _ON_THE_SPOT:
            return Twist2D(0.0, math.copysign(self._profile.max_turn * 0.8, aside))
        curvature = 2.0 * math.sin(aside) / max(pose.distance_to(x, y), 0.3)
        if self._profile.turning_radius > 0.0:
            curvature = clip(curvature, 1.0 / self._profile.turning_radius)
        if abs(curvature) * speed > self._profile.max_turn:
            speed = self._profile.max_turn / abs(curvature)
        return Twist2D(-speed if backwards else speed, speed * curvature)
