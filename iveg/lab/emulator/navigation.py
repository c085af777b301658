"""Motion of an emulated robot: drive with limits, odometer, way, route and goals.

Sources: the seed paper (AGI turns on the spot, AGII has a turning radius of 2 m); pure
pursuit (Coulter, CMU-RI-TR-92-01).  A robot whose goal was taken away stands until it
gets another; one that has returned goes on with its own route.  A robot that turns on
the spot finds its way on a grid; one with a turning radius knows no way but its own
route, and drives an open one forwards and backwards.  Left out: slip, load, slopes.
"""

import heapq
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import REST, Pose2D, Twist2D, wrap_angle
from iveg.domain.goals import Goal
from iveg.domain.observations import Navigation, Origin
from iveg.lab.emulator.greenhouse import Body, Disc, Floats, Scenery
from iveg.lab.emulator.scenarios import SPACING_M, RobotScript, Route, Station, route_of
from iveg.robot.goals import NEAR_M

_TURN_ACCELERATION = 1.5
"""Angular acceleration of a differential drive (rad/s²); assumed."""

_STEERING_RATE = 0.6
"""Change of curvature of an Ackermann drive (1/m per s); assumed."""


class Vehicle:
    """A vehicle that executes drive commands within the limits of its profile."""

    def __init__(self, profile: RobotProfile, pose: Pose2D) -> None:
        self.profile = profile
        self.pose = pose
        self.twist = Twist2D(0.0, 0.0)
        self._curvature = 0.0

    def step(self, command: Twist2D, dt: float) -> None:
        """Drive for ``dt`` (s) as commanded, within the limits."""
        speed = self._speed(command.linear_x, dt)
        if self.profile.drive == "ackermann":
            turn = speed * self._steer(command, dt)
        else:
            turn = _towards(
                self.twist.angular_z,
                clip(command.angular_z, self.profile.max_turn),
                _TURN_ACCELERATION * dt,
            )
        # Along the heading of half the turn, or each turn would end beside its arc.
        middle = self.pose.yaw + turn * dt / 2
        self.pose = Pose2D(
            self.pose.x + speed * dt * math.cos(middle),
            self.pose.y + speed * dt * math.sin(middle),
            wrap_angle(self.pose.yaw + turn * dt),
        )
        self.twist = Twist2D(speed, turn)

    def _speed(self, wanted: float, dt: float) -> float:
        now, wanted = self.twist.linear_x, clip(wanted, self.profile.max_speed)
        slower = abs(wanted) < abs(now) or now * wanted < 0.0
        limit = self.profile.braking if slower else self.profile.acceleration
        return _towards(now, wanted, limit * dt)

    def _steer(self, command: Twist2D, dt: float) -> float:
        # A command without speed defines no steering angle: it stays as it is.
        if abs(command.linear_x) > 1e-3:
            wanted = command.angular_z / command.linear_x
            wanted = clip(wanted, 1.0 / self.profile.turning_radius)
            self._curvature = _towards(self._curvature, wanted, _STEERING_RATE * dt)
        return self._curvature

    def body(self, robot_id: str) -> Body:
        """Footprint of the vehicle."""
        return Body(robot_id, self.pose, self.profile.length, self.profile.width)


def clip(value: float, limit: float) -> float:
    """The value clipped to ±``limit``."""
    return min(max(value, -limit), limit)


def _towards(value: float, target: float, most: float) -> float:
    return value + clip(target - value, most)


@dataclass(slots=True)
class Odometer:
    """Odometry: the true pose with a bounded error.

    Each metre adds an error of about 2 % along and 1 % across, each radian turned one
    of 3 %, and earlier errors decay, as with the localizer behind
    ``base_pose_ground_truth``; the error is therefore bounded, and a robot at rest
    reports a constant pose.

    Attributes:
        along: Standard deviation, part of the way driven; ``across`` likewise.
        turning: Standard deviation, part of the angle turned.
        decay_m: Distance (m) over which an error decays; ``decay_rad`` likewise.
    """

    rng: np.random.Generator
    along: float = 0.02
    across: float = 0.01
    turning: float = 0.03
    decay_m: float = 2.0
    decay_rad: float = 1.0
    _error: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def measure(self, truth: Pose2D, twist: Twist2D, dt: float) -> Pose2D:
        """The reported pose after moving with ``twist`` for ``dt`` (s)."""
        way, angle = abs(twist.linear_x) * dt, abs(twist.angular_z) * dt
        self._walk(0, self.along, way, self.decay_m)
        self._walk(1, self.across, way, self.decay_m)
        self._walk(2, self.turning, angle, self.decay_rad)
        # Driving along a row also corrects the heading of a localizer.
        self._error[2] *= math.exp(-way / self.decay_m)
        x, y = truth.transform(self._error[0], self._error[1])
        return Pose2D(x, y, wrap_angle(truth.yaw + self._error[2]))

    def _walk(self, which: int, part: float, moved: float, decay: float) -> None:
        # Ornstein-Uhlenbeck over the distance, not over time; its deviation is
        # part × decay, e.g. 2 % of 2 m = 4 cm.
        keep = math.exp(-moved / decay)
        spread = part * decay * math.sqrt(1.0 - keep * keep)
        fresh = float(self.rng.normal(0.0, spread)) if moved else 0.0
        self._error[which] = self._error[which] * keep + fresh


_CELL_M = 0.25
_MARGIN_M = 0.1
"""Room beside the robot on a way (m)."""
_SNAP_M = 0.75
_Cell = tuple[int, int]
_Place = tuple[float, float]
_STEPS = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))


def way_between(
    start: _Place, goal: _Place, scenery: Scenery, half_width_m: float
) -> list[_Place] | None:
    """Corners of the shortest way for a robot of this width; None: there is none."""
    places = _free_cells(scenery, half_width_m + _MARGIN_M)
    first, last = _cell_near(places, start), _cell_near(places, goal)
    if first is None or last is None:
        return None
    cost, came_from = {last: 0.0}, {last: last}
    queue = [(math.dist(first, last), last)]
    while queue:
        cell = heapq.heappop(queue)[1]
        if cell == first:
            return [
                start,
                *(places[passed] for passed in _chain(cell, came_from)),
                goal,
            ]
        for i, j in _STEPS:
            near, far = (cell[0] + i, cell[1] + j), cost[cell] + math.hypot(i, j)
            if near in places and far < cost.get(near, math.inf):
                cost[near], came_from[near] = far, cell
                heapq.heappush(queue, (far + math.dist(near, first), near))
    return None


def _chain(cell: _Cell, came_from: Mapping[_Cell, _Cell]) -> Iterator[_Cell]:
    """Cells between this cell and the first of the search."""
    while came_from[cell] != came_from[came_from[cell]]:
        cell = came_from[cell]
        yield cell


def _free_cells(scenery: Scenery, keep_off_m: float) -> dict[_Cell, _Place]:
    """Cells where the middle of a robot may be, with the place of each."""
    bounds = scenery.bounds
    xs = np.arange(bounds.xmin, bounds.xmax, _CELL_M) + _CELL_M / 2
    ys = np.arange(bounds.ymin, bounds.ymax, _CELL_M) + _CELL_M / 2
    x, y = np.meshgrid(xs, ys, indexing="ij")
    away = np.minimum.reduce(
        (x - bounds.xmin, bounds.xmax - x, y - bounds.ymin, bounds.ymax - y)
    )
    for xmin, ymin, xmax, ymax in scenery.rectangles:
        dx = np.maximum(np.maximum(xmin - x, x - xmax), 0.0)
        dy = np.maximum(np.maximum(ymin - y, y - ymax), 0.0)
        away = np.minimum(away, np.hypot(dx, dy))
    for px, py, radius in scenery.posts:
        away = np.minimum(away, np.hypot(x - px, y - py) - radius)
    return {
        (int(i), int(j)): (float(x[i, j]), float(y[i, j]))
        for i, j in np.argwhere(away > keep_off_m)
    }


def _cell_near(places: Mapping[_Cell, _Place], place: _Place) -> _Cell | None:
    """The free cell nearest to a place, within 0.75 m."""
    distances = {cell: math.dist(centre, place) for cell, centre in places.items()}
    nearest = min(distances, key=lambda cell: distances[cell], default=None)
    return nearest if nearest and distances[nearest] <= _SNAP_M else None


_LOOK_AHEAD_M = 0.7
_WINDOW = 12
"""Points of the route that are searched for the robot's position at each tick."""
_ON_THE_SPOT = 0.9
"""Angle to the route from which a differential robot turns on the spot (rad)."""
_COMFORT = 0.4
"""Deceleration that navigation plans (m/s²)."""
CLEARANCE_M = 0.6
"""Free distance before the robot's front below which it waits (m)."""
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

    def path(self) -> tuple[tuple[float, float], ...]:
        """The path of the next 12 m, one point per metre."""
        points = self._route.points_from(self._index, 120, self._direction)
        return tuple((float(x), float(y)) for x, y in points[::10])

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
        points = self._route.points_from(self._index, _HORIZON, self._direction)
        room = min(self._room(points, discs), self._way_to_halt() + CLEARANCE_M)
        # The speed from which it can halt in that room: v² = 2 a s.
        limit = math.sqrt(2.0 * _COMFORT * max(0.0, room - CLEARANCE_M))
        return self._pursue(pose, points, min(self._cruise, limit))

    def _locate(self, pose: Pose2D) -> None:
        window = self._route.points_from(self._index, _WINDOW, self._direction)
        distances = np.hypot(window[:, 0] - pose.x, window[:, 1] - pose.y)
        nearest = int(distances.argmin())
        index = self._index
        for _ in range(nearest):
            index = (index + self._direction) % len(self._route.points)
            # A late tick must not carry the robot past a station.
            if index in self._stations:
                break
        self._index = index

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
        # Past the station, or the robot would halt there again.
        self._index = (self._index + 3 * self._direction) % len(self._route.points)
        return False

    def _way_to_end(self) -> int:
        last = len(self._route.points) - 1
        return last - self._index if self._direction > 0 else self._index

    def _way_to_halt(self) -> float:
        """Distance to the next station or end within the horizon (m)."""
        count = len(self._route.points)
        for passed in range(_HORIZON):
            index = self._index + passed * self._direction
            ended = not self._route.closed and passed >= self._way_to_end()
            if ended or index % count in self._stations:
                return passed * SPACING_M
        return math.inf

    def _room(self, points: Floats, discs: Sequence[Disc]) -> float:
        """Free distance before the robot's front (m)."""
        if not discs:
            return math.inf
        half = self._profile.width / 2 + _SIDE_M
        places = np.array([(disc.x, disc.y, disc.radius) for disc in discs])
        dx = points[:, 0:1] - places[:, 0]
        dy = points[:, 1:2] - places[:, 1]
        blocked = (np.hypot(dx, dy) < half + places[:, 2]).any(axis=1)
        if not blocked.any():
            return math.inf
        way = int(blocked.argmax()) * SPACING_M
        return max(0.0, way + half - self._profile.length / 2)

    def _pursue(self, pose: Pose2D, points: Floats, speed: float) -> Twist2D:
        reach = min(round(_LOOK_AHEAD_M / SPACING_M), len(points) - 1)
        x, y = points[reach]
        backwards = self._direction < 0 and self._profile.turning_radius > 0.0
        heading = pose.yaw + math.pi if backwards else pose.yaw
        aside = wrap_angle(math.atan2(y - pose.y, x - pose.x) - heading)
        # An arc would sweep sideways into the crop.
        if self._profile.turning_radius == 0.0 and abs(aside) > _ON_THE_SPOT:
            return Twist2D(0.0, math.copysign(self._profile.max_turn * 0.8, aside))
        curvature = 2.0 * math.sin(aside) / max(pose.distance_to(x, y), 0.3)
        if self._profile.turning_radius > 0.0:
            curvature = clip(curvature, 1.0 / self._profile.turning_radius)
        speed = min(speed, self._profile.max_turn / max(abs(curvature), 1e-9))
        return Twist2D(-speed if backwards else speed, speed * curvature)


_STAYS_S = 3.0
"""Time that a robot stands after its return, before it goes on (s)."""


class Navigator:
    """Follows a robot's route, or drives it to a goal.

    Args:
        profile: Body of the robot.
        script: Its own work.
    """

    def __init__(self, profile: RobotProfile, script: RobotScript) -> None:
        self._profile, self._script = profile, script
        self._goal: Goal | None = None
        self._there_since = math.inf
        self._follower: Follower | None = self._own_work(script.start)

    def _own_work(self, pose: Pose2D) -> Follower:
        script = self._script
        route, stations = script.route(), script.stations
        return Follower(self._profile, route, pose, script.cruise, stations)

    def pursue(self, goal: Goal | None, pose: Pose2D, scenery: Scenery) -> bool:
        """Drive to a goal; None: give it up and stand.

        Returns:
            Whether it knows a way there.
        """
        if goal is None:
            # On its own way the robot has nothing to give up.
            if self._goal is not None:
                self._goal = self._follower = None
            return True
        follower = None
        if goal.kind != "pause":
            follower = self._way_to(goal, pose, scenery)
            if follower is None:
                return False
        self._goal, self._follower, self._there_since = goal, follower, math.inf
        return True

    def _way_to(self, goal: Goal, pose: Pose2D, scenery: Scenery) -> Follower | None:
        """The way to a goal and its end there; None: no way is known."""
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
            self._there_since = min(self._there_since, now)
            if self._goal.kind == "return" and now - self._there_since >= _STAYS_S:
                self._goal, self._follower = None, self._own_work(pose)
        return twist

    def intent(self, robot_id: str) -> Navigation:
        """Task, goal and path."""
        goal, follower = self._goal, self._follower
        if follower is None:
            return Navigation(robot_id, Origin(), "waiting")
        path, task = follower.path(), "goal" if goal else self._script.task
        place = (goal.x, goal.y) if goal else path[-1]
        if follower.at_station:
            task = "waiting"
        return Navigation(robot_id, Origin(), task, place, path)


def _end_on(route: Route, goal: Goal) -> tuple[float, float]:
    """Point at which a robot that comes along a route stops for a goal (m).

    The last two points of an open route are left out: followers turn round there.
    """
    index, last = route.index_of(goal.x, goal.y), len(route.points) - 1
    if not route.closed:
        index = max(min(index, last - 2), min(2, last // 2))
    x, y = route.points[index]
    return float(x), float(y)


def _route_along(corners: Sequence[tuple[float, float]]) -> Route:
    """A way as a route of two points at least, also where start and end coincide."""
    x, y = corners[0]
    if corners[-1] == (x, y):
        corners = (x, y), (x + 0.01, y)
    return route_of(corners, 0.0, closed=False)
