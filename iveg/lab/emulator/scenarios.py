"""Named runs as data: routes of robots and rounds of people (``docs/emulator.md``).

All but ``nlos-field`` are written for the testbed of the paper (``mvsim-20x20``):
corridors lie at x = 2, 6, 10, 14, 18 m, crop between them at x = 4, 8, 12, 16 m from
y = 3.5 to 16.5 m.  ``layout.py`` fits a scenario to other fleets and greenhouses.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import PERSON_RADIUS_M, Pose2D
from iveg.lab.emulator.greenhouse import Body, Disc, Floats, Scenery

WALKING_SPEED = 1.4
"""(m/s), as in the seed paper; ISO 13855 assumes 1.6."""

_KEEPS_OFF_M = 0.45
"""Distance between a person and a robot below which the person steps aside (m)."""
_STEP_ASIDE_SPEED = 0.8
_ARRIVED_M = 0.05


@dataclass(frozen=True, slots=True)
class WalkStop:
    """A place to walk to, and the time spent there (s)."""

    x: float
    y: float
    least_s: float = 0.0
    most_s: float = 0.0


class SimulatedPerson:
    """One person with a round of stops.

    Args:
        round_: Stops in order; the first follows the last.
        rng: Random source of the time at each stop.
    """

    def __init__(self, round_: Sequence[WalkStop], rng: np.random.Generator) -> None:
        self._round = tuple(round_)
        self._rng = rng
        self._next = 0
        self._busy_s = self._drawn()
        self.x, self.y = round_[0].x, round_[0].y

    @property
    def disc(self) -> Disc:
        """Footprint of the person."""
        return Disc(self.x, self.y, PERSON_RADIUS_M)

    def step(self, dt: float, robots: Sequence[Body], scenery: Scenery) -> None:
        """Walk, work or step aside for ``dt`` (s)."""
        move_x, move_y = self._walk(dt)
        for robot in robots:
            move_x, move_y = self._give_way(move_x, move_y, dt, robot)
        self._move(move_x, move_y, scenery)

    def _drawn(self) -> float:
        stop = self._round[self._next]
        return float(self._rng.uniform(stop.least_s, stop.most_s))

    def _walk(self, dt: float) -> tuple[float, float]:
        if self._busy_s > 0.0:
            self._busy_s -= dt
            if self._busy_s <= 0.0:
                self._next = (self._next + 1) % len(self._round)
            return 0.0, 0.0
        goal = self._round[self._next]
        dx, dy = goal.x - self.x, goal.y - self.y
        away = math.hypot(dx, dy)
        if away < _ARRIVED_M:
            self._busy_s = max(self._drawn(), dt)
            return 0.0, 0.0
        way = min(WALKING_SPEED * dt, away)
        return dx / away * way, dy / away * way

    def _give_way(
        self, move_x: float, move_y: float, dt: float, robot: Body
    ) -> tuple[float, float]:
        distance, out_x, out_y = robot.gap_to(self.x, self.y)
        near = _KEEPS_OFF_M + PERSON_RADIUS_M - distance
        if near <= 0.0:
            return move_x, move_y
        inward = move_x * out_x + move_y * out_y
        if inward < 0.0:
            move_x, move_y = self._slide(move_x, move_y, out_x, out_y)
        # No faster than somebody steps: a fast robot still comes near.
        push = min(near, _STEP_ASIDE_SPEED * dt)
        return move_x + out_x * push, move_y + out_y * push

    def _slide(
        self, move_x: float, move_y: float, out_x: float, out_y: float
    ) -> tuple[float, float]:
        """Turn a step sideways along the robot; head-on, to the robot's left."""
        along = move_y * out_x - move_x * out_y
        way = math.hypot(move_x, move_y)
        turn = math.copysign(way, along) if abs(along) > 0.05 * way else way
        return -out_y * turn, out_x * turn

    def _move(self, dx: float, dy: float, scenery: Scenery) -> None:
        """Move by this step, or along an obstacle; a person inside one may leave it."""
        inside = not scenery.free(self.x, self.y, PERSON_RADIUS_M)
        for step_x, step_y in ((dx, dy), (dx, 0.0), (0.0, dy)):
            x, y = self.x + step_x, self.y + step_y
            if inside or scenery.free(x, y, PERSON_RADIUS_M):
                self.x, self.y = x, y
                return


SPACING_M = 0.1
"""Between neighbouring points of a route."""


@dataclass(frozen=True, slots=True)
class Station:
    """A point of the route where a robot halts for a while.

    Attributes:
        dwell_s: Duration of the halt.
        period_s: With a timetable it leaves at the next ``offset_s`` + n × period.
    """

    x: float
    y: float
    dwell_s: float = 0.0
    period_s: float = 0.0
    offset_s: float = 0.0

    def departure(self, arrival: float) -> float:
        """Time of departure after an arrival (both s into the run)."""
        ready = arrival + self.dwell_s
        if self.period_s == 0.0:
            return ready
        turns = math.ceil((ready - self.offset_s) / self.period_s)
        return self.offset_s + turns * self.period_s


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """A route: points ``SPACING_M`` apart, shape (n, 2), in ``map`` (m).

    Attributes:
        closed: Whether the last point leads to the first.
    """

    points: Floats
    closed: bool

    def index_of(self, x: float, y: float) -> int:
        """The point nearest to a position."""
        return int(np.hypot(self.points[:, 0] - x, self.points[:, 1] - y).argmin())

    def pose_at(self, index: int) -> Pose2D:
        """Pose of a robot on point ``index`` that looks along the route."""
        (ax, ay), (bx, by) = self.points_from(index, 2)
        return Pose2D(float(ax), float(ay), math.atan2(by - ay, bx - ax))

    def points_from(self, index: int, count: int, direction: int = 1) -> Floats:
        """``count`` points from ``index`` on, fewer at the end of an open route."""
        wanted = index + direction * np.arange(count)
        if self.closed:
            wanted %= len(self.points)
        inside = (wanted >= 0) & (wanted < len(self.points))
        points: Floats = self.points[wanted[inside]]
        return points


def route_of(
    corners: Sequence[tuple[float, float]], radius: float, closed: bool
) -> Route:
    """Join corners by straight lines, rounded with ``radius`` (m) where they bend."""
    places = [np.array(corner, float) for corner in corners]
    count = len(places)
    bends = range(count) if closed else range(1, count - 1)
    pieces: list[Floats] = [] if closed else [places[0].reshape(1, 2)]
    for index in bends:
        before, corner = places[index - 1], places[index]
        pieces.append(_bend(before, corner, places[(index + 1) % count], radius))
    if not closed:
        pieces.append(places[-1].reshape(1, 2))
    return Route(_even(np.concatenate(pieces), closed), closed)


def _bend(before: Floats, corner: Floats, after: Floats, radius: float) -> Floats:
    come, leave = corner - before, after - corner
    come, leave = come / np.hypot(*come), leave / np.hypot(*leave)
    turn = math.atan2(come[0] * leave[1] - come[1] * leave[0], float(come @ leave))
    if radius == 0.0 or abs(turn) < 1e-6 or abs(turn) > math.pi - 1e-6:
        return corner.reshape(1, 2)
    reach = radius * math.tan(abs(turn) / 2)
    side = np.array((-come[1], come[0])) * math.copysign(radius, turn)
    centre = corner - reach * come + side
    steps = max(2, math.ceil(radius * abs(turn) / SPACING_M))
    angles = np.linspace(0.0, turn, steps + 1)
    c, s = np.cos(angles), np.sin(angles)
    spoke = -side
    turned = (c * spoke[0] - s * spoke[1], s * spoke[0] + c * spoke[1])
    bend: Floats = centre + np.stack(turned, axis=1)
    return bend


def _even(points: Floats, closed: bool) -> Floats:
    """Space the points of a line evenly."""
    line = np.concatenate((points, points[:1])) if closed else points
    along = np.concatenate(((0.0,), np.cumsum(np.hypot(*np.diff(line, axis=0).T))))
    count = max(2, round(along[-1] / SPACING_M))
    places = np.linspace(0.0, along[-1], count, endpoint=not closed)
    x = np.interp(places, along, line[:, 0])
    return np.stack((x, np.interp(places, along, line[:, 1])), axis=1)


# --- scripts ----------------------------------------------------------------------

TESTBED = "mvsim-20x20"
"""The greenhouse that most scenarios are written for."""


@dataclass(frozen=True, slots=True)
class RobotScript:
    """Start and route of one robot.

    Attributes:
        corners: Of its route, rounded with ``radius`` (m).
        closed: A closed route; otherwise back and forth.
        cruise: (m/s).
        task: Its reported task.
    """

    start: Pose2D
    corners: tuple[tuple[float, float], ...]
    radius: float
    task: str
    closed: bool = True
    cruise: float = 0.8
    stations: tuple[Station, ...] = ()

    def route(self) -> Route:
        """The route as points."""
        return route_of(self.corners, self.radius, self.closed)


@dataclass(frozen=True, slots=True)
class Scenario:
    """One named run.

    Attributes:
        robots: Scripts by robot id; a fleet with other ids uses the route of ``many``.
        people: Stops of each person.
        greenhouse: The greenhouse that it is written for.
    """

    name: str
    robots: Mapping[str, RobotScript]
    people: tuple[tuple[WalkStop, ...], ...] = ()
    greenhouse: str = TESTBED


_NORTH, _SOUTH, _WEST = math.pi / 2, -math.pi / 2, math.pi

# --- robots of the testbed --------------------------------------------------------

_LOOK_OUT = Station(10.0, 4.0, dwell_s=1.0, period_s=80.0, offset_s=10.0)
"""AGI waits at the entry of corridor 3, in view of the worker there, while AGII passes
the same worker on the other side of the crop."""

_SCOUT = RobotScript(
    Pose2D(10.0, 3.8, _NORTH),
    ((10.0, 2.2), (10.0, 17.8), (6.0, 17.8), (6.0, 2.2)),
    0.6,
    "scouting",
    stations=(_LOOK_OUT,),
)
_WATCH = replace(
    _SCOUT, task="watching", stations=(Station(10.0, 4.0, dwell_s=math.inf),)
)
_HAUL = RobotScript(
    Pose2D(13.2, 14.7, _SOUTH),
    ((18.0, 2.0), (18.0, 18.0), (13.2, 18.0), (13.2, 2.0)),
    2.3,
    "hauling",
    stations=(Station(13.2, 15.0, dwell_s=1.0, period_s=80.0),),
)
_HAUL_ON = replace(_HAUL, start=Pose2D(13.2, 13.0, _SOUTH), stations=())
_LAPS = RobotScript(
    Pose2D(8.9, 7.8, _NORTH),
    ((8.9, 6.0), (8.9, 14.0), (11.1, 14.0), (11.1, 6.0)),
    0.6,
    "scouting",
)
_THROUGH = replace(_SCOUT, start=Pose2D(10.0, 7.0, _NORTH), stations=())
_PAST_THE_END = RobotScript(
    Pose2D(10.4, 11.0, _NORTH),
    ((10.4, 2.2), (10.4, 17.8), (6.0, 17.8), (6.0, 2.2)),
    0.6,
    "scouting",
)
_BESIDE = RobotScript(
    Pose2D(15.0, 6.5, _NORTH),
    ((15.0, 6.5), (15.0, 14.0)),
    0.0,
    "scouting",
    closed=False,
    cruise=0.5,
)
_OPPOSITE = RobotScript(
    Pose2D(14.9, 5.6, _NORTH),
    ((14.9, 5.5), (14.9, 6.5)),
    0.0,
    "watching",
    closed=False,
    stations=(Station(14.9, 5.7, dwell_s=math.inf),),
)

# --- people of the testbed --------------------------------------------------------

_PICKER_IN_3 = (
    WalkStop(11.5, 9.0, 8.0, 14.0),
    WalkStop(11.5, 9.8, 6.0, 12.0),
    WalkStop(11.5, 10.6, 6.0, 12.0),
    WalkStop(11.5, 8.2, 6.0, 12.0),
)
_PICKER_IN_5 = (
    WalkStop(19.2, 6.0, 4.0, 10.0),
    WalkStop(19.2, 9.0, 4.0, 10.0),
    WalkStop(19.2, 13.0, 4.0, 10.0),
    WalkStop(19.2, 10.0, 4.0, 10.0),
)
_VISITOR_IN_2 = (
    WalkStop(4.7, 2.8, 2.0, 5.0),
    WalkStop(4.7, 8.0, 3.0, 8.0),
    WalkStop(4.7, 15.0, 3.0, 8.0),
    WalkStop(4.7, 17.0, 1.0, 3.0),
    WalkStop(4.7, 11.0, 3.0, 8.0),
)
_CARRIER = (
    WalkStop(10.6, 18.9, 8.0, 12.0),
    WalkStop(8.7, 17.2),
    WalkStop(8.7, 3.0),
    WalkStop(10.6, 1.2, 5.0, 8.0),
    WalkStop(8.7, 3.0),
    WalkStop(8.7, 17.2),
)
_FOUR_PEOPLE = (_PICKER_IN_3, _VISITOR_IN_2, _PICKER_IN_5, _CARRIER)
_STANDER = (WalkStop(10.0, 10.0, 60.0, 60.0),)
_AT_THE_END = (WalkStop(11.9, 17.2, 60.0, 60.0),)
_CROSSER = (WalkStop(8.6, 10.0, 1.0, 3.0), WalkStop(11.4, 10.0, 1.0, 3.0))

# --- the field test of the paper --------------------------------------------------

_FACES_GROWER = RobotScript(
    Pose2D(25.0, 31.5, _SOUTH),
    ((25.0, 31.6), (25.0, 30.6)),
    0.0,
    "watching",
    closed=False,
    stations=(Station(25.0, 31.4, dwell_s=math.inf),),
)
_FACES_AWAY = RobotScript(
    Pose2D(20.0, 23.9, _WEST),
    ((26.5, 23.9), (19.5, 23.9)),
    0.0,
    "hauling",
    closed=False,
)
"""Looks west, drives a little, then comes back east in reverse, past the aisle whose
grower it never looks at."""
_GROWER_IN_6 = (WalkStop(24.3, 25.5, 60.0, 60.0),)

_SCENARIOS = (
    Scenario(
        "demo",
        {"AGI": _SCOUT, "AGII": _HAUL},
        _FOUR_PEOPLE,
    ),
    Scenario(
        "nlos",
        {"AGI": _WATCH, "AGII": _HAUL_ON},
        (_PICKER_IN_3,),
    ),
    Scenario(
        "nlos-field",
        {"AGI": _FACES_GROWER, "AGII": _FACES_AWAY},
        (_GROWER_IN_6,),
        greenhouse="agroconnect",
    ),
    Scenario(
        "viewpoints",
        {"AGI": _LAPS, "AGII": _HAUL},
        (_STANDER,),
    ),
    Scenario(
        "peers",
        {"AGI": _BESIDE, "AGII": _HAUL_ON},
    ),
    Scenario(
        "together",
        {"AGI": _OPPOSITE, "AGII": _HAUL_ON},
        ((WalkStop(15.1, 10.5, 10.0, 20.0), WalkStop(15.1, 11.5, 10.0, 20.0)),),
    ),
    Scenario(
        "occluded",
        {"AGI": _PAST_THE_END, "AGII": _HAUL},
        (_AT_THE_END,),
    ),
    Scenario(
        "many",
        {},
        _FOUR_PEOPLE,
    ),
    Scenario(
        "crossing",
        {"AGI": _THROUGH, "AGII": _HAUL},
        (_CROSSER,),
    ),
)
SCENARIOS: Mapping[str, Scenario] = {scenario.name: scenario for scenario in _SCENARIOS}


def scenario_named(name: str) -> Scenario:
    """The scenario of a name.

    Raises:
        DataFileError: unknown name; lists the known ones.
    """
    if name not in SCENARIOS:
        known = ", ".join(SCENARIOS)
        raise DataFileError(f"scenario {name!r}", "", f"is not one of {known}.")
    return SCENARIOS[name]
