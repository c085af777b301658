"""Named runs as data: who drives where, who walks where, what goes wrong when.

The scripts are written for the testbed of the paper (``mvsim-20x20``): corridors lie at
x = 2, 6, 10, 14, 18 m, crop between them at x = 4, 8, 12, 16 m from y = 3.5 to 16.5 m.
``layout.py`` fits a scenario to another fleet or another house.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D
from iveg.emulator.orders import FaultOrder
from iveg.emulator.people import Stop
from iveg.emulator.routes import Route, Station, route_of

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
        order: What.
    """

    at_s: float
    order: FaultOrder
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
        (Incident(20.0, FaultOrder(robot="AGII", deaf=True)),),
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
            Incident(20.0, FaultOrder(robot="AGII", mute=True), every_s=60.0),
            Incident(30.0, FaultOrder(robot="AGII", mute=False), every_s=60.0),
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
