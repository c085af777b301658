"""Named runs as data: routes of robots, rounds of people, faults, expected outcome.

All but ``nlos-field`` are written for the testbed of the paper (``mvsim-20x20``):
corridors lie at x = 2, 6, 10, 14, 18 m, crop between them at x = 4, 8, 12, 16 m from
y = 3.5 to 16.5 m.  ``layout.py`` fits a scenario to other fleets and greenhouses.
"""

import math
from collections.abc import Mapping

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D
from iveg.lab.emulator.orders import FaultOrder, OrderPlace
from iveg.lab.emulator.people import WalkStop
from iveg.lab.emulator.scripts import Incident, RobotScript, Scenario, Station

_FOREVER_S = 1e9
_NORTH, _SOUTH, _WEST = math.pi / 2, -math.pi / 2, math.pi

# --- robots of the testbed --------------------------------------------------------

_SCOUT_CORNERS = ((10.0, 2.2), (10.0, 17.8), (6.0, 17.8), (6.0, 2.2))
_LOOK_OUT = Station(10.0, 4.0, dwell_s=1.0, period_s=80.0, offset_s=10.0)
"""AGI waits at the entry of corridor 3, in view of the worker there, while AGII passes
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
_HAUL_ON = RobotScript(Pose2D(13.2, 13.0, _SOUTH), _HAUL_CORNERS, 2.3, "hauling")
_LAPS = RobotScript(
    Pose2D(8.9, 7.8, _NORTH),
    ((8.9, 6.0), (8.9, 14.0), (11.1, 14.0), (11.1, 6.0)),
    0.6,
    "scouting",
)
_THROUGH = RobotScript(Pose2D(10.0, 7.0, _NORTH), _SCOUT_CORNERS, 0.6, "scouting")
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
    stations=(Station(14.9, 5.7, period_s=_FOREVER_S, offset_s=_FOREVER_S),),
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
_WALKER_IN_2 = (
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
_FOUR_PEOPLE = (_PICKER_IN_3, _WALKER_IN_2, _PICKER_IN_5, _CARRIER)
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
    stations=(Station(25.0, 31.4, period_s=_FOREVER_S, offset_s=_FOREVER_S),),
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

_COAT = OrderPlace(x=11.5, y=9.0)
"""Hangs where the worker of corridor 3 stands in other scenarios."""

_SCENARIOS = (
    Scenario(
        "demo",
        "Two robots and four people; robots slow for people seen and unseen.",
        "AGII slows for the worker whom only AGI sees, and drives on afterwards.",
        {"AGI": _SCOUT, "AGII": _HAUL},
        _FOUR_PEOPLE,
    ),
    Scenario(
        "nlos",
        "AGI sees a person across the crop from AGII.",
        "AGII slows for the person without a line of sight; AGI is the observer.",
        {"AGI": _WATCH, "AGII": _HAUL_ON},
        (_PICKER_IN_3,),
    ),
    Scenario(
        "nlos-field",
        "AGII reverses along the central corridor and looks away from the aisle where "
        "AGI faces a grower.",
        "AGII slows for the grower without a line of sight; AGI is the observer.",
        {"AGI": _FACES_GROWER, "AGII": _FACES_AWAY},
        (_GROWER_IN_6,),
        greenhouse="agroconnect",
    ),
    Scenario(
        "coat",
        "AGI takes a coat in corridor 3 for a person; nobody is there.",
        "AGII slows for it, until somebody marks it as no person.",
        {"AGI": _WATCH, "AGII": _HAUL_ON},
        incidents=(Incident(0.1, FaultOrder(robot="AGI", thing=_COAT)),),
        detector="simulation",
    ),
    Scenario(
        "viewpoints",
        "One person, seen from all sides as AGI goes round.",
        "It stays one person at one place, seen from the south and from the north.",
        {"AGI": _LAPS, "AGII": _HAUL},
        (_STANDER,),
    ),
    Scenario(
        "peers",
        "AGI and AGII pass each other again and again in corridor 4; nobody else.",
        "Both slow for each other.",
        {"AGI": _BESIDE, "AGII": _HAUL_ON},
    ),
    Scenario(
        "together",
        "A person and AGII in one frame of AGI.",
        "One look holds both; the person is an alert, AGII is known for a peer.",
        {"AGI": _OPPOSITE, "AGII": _HAUL_ON},
        ((WalkStop(15.1, 10.5, 10.0, 20.0), WalkStop(15.1, 11.5, 10.0, 20.0)),),
    ),
    Scenario(
        "occluded",
        "A person half hidden by the end of a crop row.",
        "AGI is less sure of the person while half hidden, and slows in time.",
        {"AGI": _PAST_THE_END, "AGII": _HAUL},
        (_AT_THE_END,),
    ),
    Scenario(
        "many",
        "Any number of robots on one round, four people inside.",
        "All are live and drive; none is lost.",
        {},
        _FOUR_PEOPLE,
    ),
    Scenario(
        "deaf",
        "As nlos, but AGII drives as it likes whatever iVeg says.",
        "Two seconds after AGII met a person at full speed there is a P1 alert.",
        {"AGI": _WATCH, "AGII": _HAUL_ON},
        (_PICKER_IN_3,),
        (Incident(1.0, FaultOrder(robot="AGII", deaf=True)),),
    ),
    Scenario(
        "noisy-crossing",
        "A person crosses in front of AGI under a detector that flickers about its "
        "threshold.",
        "AGI slows once and speeds up once.",
        {"AGI": _THROUGH, "AGII": _HAUL},
        (_CROSSER,),
        detector="noisy",
    ),
    Scenario(
        "link-loss",
        "As demo; each minute nothing that AGII says arrives for five seconds.",
        "AGII is late, then lost; meanwhile it slows and stands, and later drives on.",
        {"AGI": _SCOUT, "AGII": _HAUL},
        _FOUR_PEOPLE,
        (
            Incident(4.0, FaultOrder(robot="AGII", mute=True), every_s=60.0),
            Incident(9.0, FaultOrder(robot="AGII", mute=False), every_s=60.0),
        ),
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
