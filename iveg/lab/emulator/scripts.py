"""Parts of a scenario: scripts and routes of robots, rounds of people, incidents."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from iveg.domain.geometry import Pose2D
from iveg.lab.emulator.greenhouse import Floats
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.people import WalkStop

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
        away = np.hypot(self.points[:, 0] - x, self.points[:, 1] - y)
        return int(away.argmin())

    def pose_at(self, index: int) -> Pose2D:
        """Pose of a robot on point ``index`` that looks along the route."""
        (ax, ay), (bx, by) = self.ahead(index, 2)
        return Pose2D(float(ax), float(ay), math.atan2(by - ay, bx - ax))

    def ahead(self, index: int, count: int, direction: int = 1) -> Floats:
        """``count`` points from ``index`` on, fewer at the end of an open route."""
        wanted = index + direction * np.arange(count)
        if self.closed:
            wanted %= len(self.points)
        inside = (wanted >= 0) & (wanted < len(self.points))
        found: Floats = self.points[wanted[inside]]
        return found


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
    """The same line with evenly spaced points."""
    line = np.concatenate((points, points[:1])) if closed else points
    steps = np.hypot(*np.diff(line, axis=0).T)
    along = np.concatenate(((0.0,), np.cumsum(steps)))
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
class Incident:
    """A fault injected during a run.

    Attributes:
        at_s: Seconds into the run; again every ``every_s`` where that is not 0.
        order: The fault.
    """

    at_s: float
    order: FaultOrder
    every_s: float = 0.0


@dataclass(frozen=True, slots=True)
class SiteErrors:
    """What a site gets wrong.

    Attributes:
        plan_off_m: How far east of where the plan draws it everything stands (m).
        pose_error: How many times its usual error odometry makes.
    """

    plan_off_m: float = 0.0
    pose_error: float = 1.0


EXACT = SiteErrors()


@dataclass(frozen=True, slots=True)
class Scenario:
    """One named run.

    Attributes:
        about: Purpose in one sentence.
        outcome: Expected outcome in iVeg; checked by a test of the whole stack.
        robots: Scripts by robot id; a fleet with other ids uses the route of ``many``.
        people: Stops of each person.
        detector: Replaces the requested detector profile.
        greenhouse: The greenhouse that it is written for.
        errors: Of its plan and poses.
    """

    name: str
    about: str
    outcome: str
    robots: Mapping[str, RobotScript]
    people: tuple[tuple[WalkStop, ...], ...] = ()
    incidents: tuple[Incident, ...] = ()
    detector: str | None = None
    greenhouse: str = TESTBED
    errors: SiteErrors = EXACT
