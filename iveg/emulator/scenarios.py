"""Named runs as data: who drives where, who walks where, what goes wrong when.

The scripts are written for the testbed of the paper (``mvsim-20x20``): corridors lie at
x = 2, 6, 10, 14, 18 m, crop between them at x = 4, 8, 12, 16 m from y = 3.5 to 16.5 m.
In any other house, and for a fleet that a script does not know, robots drive up and
down lanes of their own and people walk beside them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse, Lane
from iveg.domain.profiles import profile_of
from iveg.emulator.people import Stop
from iveg.emulator.routes import Route, Station, route_of

TESTBED = "mvsim-20x20"
_FOREVER_S = 1e9
_NORTH, _SOUTH = math.pi / 2, -math.pi / 2


@dataclass(frozen=True, slots=True)
class RobotScript:
    """Where one robot starts and drives.

    Attributes:
        corners: Of its route, rounded with ``radius`` (m).
        closed: A round; otherwise there and back.
        cruise: (m/s).
        task: Its intent in a word.
    """

    start: Pose2D
    corners: tuple[tuple[float, float], ...]
    radius: float
    task: str
    closed: bool = True
    cruise: float = 0.8
    stations: tuple[Station, ...] = ()

    def route(self) -> Route:
        """The way as points."""
        return route_of(self.corners, self.radius, self.closed)


@dataclass(frozen=True, slots=True)
class Incident:
    """Something that goes wrong on purpose.

    Attributes:
        at_s: Seconds into the run; again every ``every_s`` where that is not 0.
        mute: Whether the robot says nothing, and so gets no answer either; ``deaf``
            whether it ignores what iVeg mandates; None leaves it.
    """

    at_s: float
    robot_id: str
    mute: bool | None = None
    deaf: bool | None = None
    every_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Scenario:
    """One named run.

    Attributes:
        about: What it shows, in one sentence.
        robots: Scripts by robot id; a fleet with others drives ``many``'s round.
        people: The round of each person.
        detector: Takes the place of the profile that was asked for.
    """

    name: str
    about: str
    robots: Mapping[str, RobotScript]
    people: tuple[tuple[Stop, ...], ...] = ()
    incidents: tuple[Incident, ...] = ()
    detector: str | None = None


@dataclass(frozen=True, slots=True)
class Layout:
    """A scenario laid out for one fleet in one house."""

    robots: Mapping[str, RobotScript]
    people: tuple[tuple[Stop, ...], ...]
    incidents: tuple[Incident, ...] = ()
    detector: str | None = None


# --- robots of the testbed --------------------------------------------------------

_SCOUT_CORNERS = ((10.0, 2.2), (10.0, 17.8), (6.0, 17.8), (6.0, 2.2))
_LOOK_OUT = Station(10.0, 4.0, dwell_s=1.0, period_s=80.0, offset_s=10.0)
"""AGI waits at the mouth of corridor 3, in view of the worker there, while AGII passes
the same worker on the other side of the crop."""

_SCOUT = RobotScript(
    Pose2D(10.0, 3.8, _NORTH),
    _SCOUT_CORNERS,
    0.6,
    "scouting",
    stations=(_LOOK_OUT,),
)
_WATCH = RobotScript(
    Pose2D(10.0, 3.8, _NORTH),
    _SCOUT_CORNERS,
    0.6,
    "watching",
    stations=(Station(10.0, 4.0, period_s=_FOREVER_S, offset_s=_FOREVER_S),),
)
_HAUL_CORNERS = ((18.0, 2.0), (18.0, 18.0), (13.2, 18.0), (13.2, 2.0))
_HAUL = RobotScript(
    Pose2D(13.2, 14.7, _SOUTH),
    _HAUL_CORNERS,
    2.3,
    "hauling",
    stations=(Station(13.2, 15.0, dwell_s=1.0, period_s=80.0),),
)
_HAUL_ON = RobotScript(Pose2D(13.2, 15.2, _SOUTH), _HAUL_CORNERS, 2.3, "hauling")
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
    stations=(Station(14.9, 5.7, period_s=_FOREVER_S, offset_s=_FOREVER_S),),
)
_RING_CORNERS = ((18.0, 2.0), (18.0, 18.0), (2.0, 18.0), (2.0, 2.0))

# --- people of the testbed --------------------------------------------------------

_PICKER_IN_3 = (
    Stop(11.5, 9.0, 8.0, 14.0),
    Stop(11.5, 9.8, 6.0, 12.0),
    Stop(11.5, 10.6, 6.0, 12.0),
    Stop(11.5, 8.2, 6.0, 12.0),
)
_PICKER_IN_5 = (
    Stop(19.2, 6.0, 4.0, 10.0),
    Stop(19.2, 9.0, 4.0, 10.0),
    Stop(19.2, 13.0, 4.0, 10.0),
    Stop(19.2, 10.0, 4.0, 10.0),
)
_WALKER_IN_2 = (
    Stop(4.7, 2.8, 2.0, 5.0),
    Stop(4.7, 8.0, 3.0, 8.0),
    Stop(4.7, 15.0, 3.0, 8.0),
    Stop(4.7, 17.0, 1.0, 3.0),
    Stop(4.7, 11.0, 3.0, 8.0),
)
_CARRIER = (
    Stop(10.6, 18.9, 8.0, 12.0),
    Stop(8.7, 17.2),
    Stop(8.7, 3.0),
    Stop(10.6, 1.2, 5.0, 8.0),
    Stop(8.7, 3.0),
    Stop(8.7, 17.2),
)
_FOUR_PEOPLE = (_PICKER_IN_3, _WALKER_IN_2, _PICKER_IN_5, _CARRIER)
_STANDER = tuple(
    Stop(x, y, 20.0, 20.0)
    for x, y in ((11.2, 9.0), (11.2, 3.0), (8.9, 18.9), (4.9, 10.0))
)
_HALF_HIDDEN = (Stop(12.7, 17.1, 4.0, 8.0), Stop(11.5, 17.1, 4.0, 8.0))
_CROSSER = (Stop(8.6, 10.0, 1.0, 3.0), Stop(11.4, 10.0, 1.0, 3.0))

_SCENARIOS = (
    Scenario(
        "demo",
        "Two robots and four people; robots slow for people seen and unseen.",
        {"AGI": _SCOUT, "AGII": _HAUL},
        _FOUR_PEOPLE,
    ),
    Scenario(
        "nlos",
        "AGI sees a person whom AGII cannot see; AGII slows.",
        {"AGI": _WATCH, "AGII": _HAUL_ON},
        (_PICKER_IN_3,),
    ),
    Scenario(
        "viewpoints",
        "One person, seen from all sides as AGI goes round.",
        {"AGI": _SCOUT, "AGII": _HAUL},
        (_STANDER,),
    ),
    Scenario(
        "peers",
        "AGI and AGII pass each other again and again in corridor 4; nobody else.",
        {"AGI": _BESIDE, "AGII": _HAUL_ON},
    ),
    Scenario(
        "together",
        "A person and AGII in one frame of AGI.",
        {"AGI": _OPPOSITE, "AGII": _HAUL_ON},
        ((Stop(15.1, 10.5, 10.0, 20.0), Stop(15.1, 11.5, 10.0, 20.0)),),
    ),
    Scenario(
        "occluded",
        "A person half hidden by the end of a crop row.",
        {"AGI": _SCOUT, "AGII": _HAUL},
        (_HALF_HIDDEN,),
    ),
    Scenario(
        "many",
        "Any number of robots on one round, four people inside.",
        {},
        _FOUR_PEOPLE,
    ),
    Scenario(
        "deaf",
        "As demo; after 20 s AGII drives as it likes whatever the rule says.",
        {"AGI": _SCOUT, "AGII": _HAUL},
        _FOUR_PEOPLE,
        (Incident(20.0, "AGII", deaf=True),),
    ),
    Scenario(
        "noisy-crossing",
        "A person crosses in front of AGI under a detector near its threshold.",
        {"AGI": _SCOUT, "AGII": _HAUL},
        (_CROSSER,),
        detector="noisy",
    ),
    Scenario(
        "link-loss",
        "As demo; every minute AGII is not heard for ten seconds, and stops.",
        {"AGI": _SCOUT, "AGII": _HAUL},
        _FOUR_PEOPLE,
        (
            Incident(20.0, "AGII", mute=True, every_s=60.0),
            Incident(30.0, "AGII", mute=False, every_s=60.0),
        ),
    ),
)
SCENARIOS: Mapping[str, Scenario] = {scenario.name: scenario for scenario in _SCENARIOS}


def scenario_named(name: str) -> Scenario:
    """The scenario of that name.

    Raises:
        DataFileError: there is none; lists those that exist.
    """
    if name not in SCENARIOS:
        known = ", ".join(SCENARIOS)
        raise DataFileError(f"scenario {name!r}", "", f"is not one of {known}.")
    return SCENARIOS[name]


# --- laying out -------------------------------------------------------------------

_END_M, _KEEP_OFF_M = 0.5, 0.9
_FIELD_M, _FIELD_PITCH_M = 12.0, 20.0
_MOST_ON_THE_RING = 20


def lay_out(scenario: Scenario, robots: Sequence[str], house: Greenhouse) -> Layout:
    """Fit a scenario to a fleet and a house.

    Raises:
        DataFileError: the house has no room for so many robots.
    """
    extra = scenario.incidents, scenario.detector
    if house.name == TESTBED and set(robots) <= set(scenario.robots):
        scripts = {robot_id: scenario.robots[robot_id] for robot_id in robots}
        return Layout(scripts, scenario.people, *extra)
    if house.name == TESTBED:
        return Layout(_on_the_ring(robots), scenario.people, *extra)
    if not house.lanes:
        return Layout(_in_a_field(robots), _around_the_field(robots), *extra)
    lanes = _lanes_for(robots, house)
    scripts = {
        robot_id: _up_and_down(lane.area, house)
        for robot_id, lane in zip(robots, lanes, strict=True)
    }
    return Layout(scripts, tuple(_beside(lane.area) for lane in lanes[:4]), *extra)


def _on_the_ring(robots: Sequence[str]) -> dict[str, RobotScript]:
    """All on one round, one way, evenly spaced: nobody meets anybody."""
    if len(robots) > _MOST_ON_THE_RING:
        reason = f"has room for {_MOST_ON_THE_RING} robots, not for {len(robots)}."
        raise DataFileError(TESTBED, "", reason)
    route = route_of(_RING_CORNERS, 2.3, True)
    gap = len(route.points) / len(robots)
    return {
        robot_id: RobotScript(
            route.pose_at(int(place * gap)), _RING_CORNERS, 2.3, "patrol", cruise=0.6
        )
        for place, robot_id in enumerate(robots)
    }


def _in_a_field(robots: Sequence[str]) -> dict[str, RobotScript]:
    """Each on a square of its own."""
    scripts = {}
    for place, robot_id in enumerate(robots):
        x = place * _FIELD_PITCH_M
        corners = (
            (x, 0.0),
            (x + _FIELD_M, 0.0),
            (x + _FIELD_M, _FIELD_M),
            (x, _FIELD_M),
        )
        start = Pose2D(x + 3.0, 0.0, 0.0)
        scripts[robot_id] = RobotScript(start, corners, 2.3, "patrol")
    return scripts


def _around_the_field(robots: Sequence[str]) -> tuple[tuple[Stop, ...], ...]:
    return tuple(
        (
            Stop(x + 6.0, 1.4, 4.0, 8.0),
            Stop(x + 10.6, 6.0, 4.0, 8.0),
            Stop(x + 6.0, 10.6, 4.0, 8.0),
        )
        for x in (place * _FIELD_PITCH_M for place in range(min(4, len(robots))))
    )


def _lanes_for(robots: Sequence[str], house: Greenhouse) -> list[Lane]:
    """A lane each: the one its start lies in, else the longest that is left.

    Who needs most room to turn chooses first.
    """
    lanes = sorted(house.lanes, key=lambda lane: -_long(lane.area))
    if len(robots) > len(lanes):
        reason = f"has {len(lanes)} lanes, too few for {len(robots)} robots."
        raise DataFileError(f"greenhouse {house.name!r}", "", reason)
    chosen: dict[str, Lane] = {}
    for robot_id, start in zip(robots, house.starts, strict=False):
        here = [lane for lane in lanes if lane.area.contains(start.x, start.y)]
        if here:
            chosen[robot_id] = here[0]
            lanes.remove(here[0])
    needy = sorted(robots, key=lambda robot_id: -profile_of(robot_id).turning_radius)
    for robot_id in needy:
        if robot_id not in chosen:
            chosen[robot_id] = lanes.pop(0)
    return [chosen[robot_id] for robot_id in robots]


def _long(area: Rectangle) -> float:
    return max(area.xmax - area.xmin, area.ymax - area.ymin)


def _ends(area: Rectangle, aside: float) -> tuple[tuple[float, float], ...]:
    """Both ends of a lane, ``aside`` (m) to the right of its middle."""
    inset = 0.7 + _END_M
    if area.xmax - area.xmin >= area.ymax - area.ymin:
        y = (area.ymin + area.ymax) / 2 - aside
        return ((area.xmin + inset, y), (area.xmax - inset, y))
    x = (area.xmin + area.xmax) / 2 + aside
    return ((x, area.ymin + inset), (x, area.ymax - inset))


def _up_and_down(area: Rectangle, house: Greenhouse) -> RobotScript:
    (ax, ay), (bx, by) = _free_stretch(_ends(area, 0.0), house)
    start = Pose2D(ax, ay, math.atan2(by - ay, bx - ax))
    return RobotScript(start, ((ax, ay), (bx, by)), 0.0, "patrol", closed=False)


def _free_stretch(
    ends: tuple[tuple[float, float], ...], house: Greenhouse
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The longest part of a line that keeps off crates, trolleys and posts."""
    line = route_of(ends, 0.0, False).points
    best, run = (0, 0), 0
    for index, (x, y) in enumerate(line):
        things = (thing.area for thing in house.obstacles)
        blocked = any(area.contains(x, y, _KEEP_OFF_M) for area in things) or any(
            math.hypot(post.x - x, post.y - y) < post.radius + _KEEP_OFF_M
            for post in house.posts
        )
        run = index + 1 if blocked else run
        if index - run > best[1] - best[0]:
            best = (run, index)
    (ax, ay), (bx, by) = line[best[0]], line[best[1]]
    return (float(ax), float(ay)), (float(bx), float(by))


def _beside(area: Rectangle) -> tuple[Stop, ...]:
    narrow = min(area.xmax - area.xmin, area.ymax - area.ymin)
    (ax, ay), (bx, by) = _ends(area, max(0.0, narrow / 2 - 0.3))
    middle = Stop((ax + bx) / 2, (ay + by) / 2, 3.0, 8.0)
    return (middle, Stop(bx, by, 2.0, 6.0), middle, Stop(ax, ay, 2.0, 6.0))
