"""The kinds of observation: one row says what becomes of each on its way.

How it is ordered, whether it may be dropped, where it lands, which topics it touches,
how it is read past FIWARE and when it is worth an alert.  How it is spelled on the wire
stands in ``ngsi`` (``sensors``, ``codec``), which knows nothing of this table.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

from iveg.domain.events import Condition, Slot
from iveg.domain.observations import (
    Battery,
    Climate,
    CommandAnswer,
    CommandStatus,
    DetectionFrame,
    HeartbeatProbe,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    SafetyReport,
    kind_of,
)
from iveg.domain.robot_state import RobotState
from iveg.pipeline import topics
from iveg.pipeline.topics import Topic

Scope = Literal["all", "safety", "off"]
_SCOPES: dict[Scope, int] = {"off": 0, "safety": 1, "all": 2}
SCANS_APART_S = 0.045
"""A page draws 15 a second and the costmap 4; of 30 that come every second is read."""


@dataclass(frozen=True, slots=True)
class Low:
    """A value that raises an alert when it is low.

    Attributes:
        value: Reads it; None where it is unknown or nothing is wrong with it being low.
        below: Raised at or below this, cleared at or above ``above``.
    """

    key: str
    value: Callable[[Any], float | None]
    below: float
    above: float
    slot: str


@dataclass(frozen=True, slots=True)
class Kind:
    """One row.

    Attributes:
        of: The observation.
        ordered: By the robot's own count, or by arrival.
        may_drop: Whether the oldest gives way when more comes than can be taken.
        lands: Member of ``RobotState`` or ``World`` that keeps the newest; None for an
            event: the machine of its command or the health monitor takes it.
        touches: Topics that are new with it; those of detections depend on what is
            seen, those of a command on the machine.
        direct: From which scope on it is read straight from MQTT; ``off`` never.
        qos: There.  At 0 the inbox keeps the newest of a topic alone.
        apart_s: There, least time between two of a robot that are read (s).
        low: When it is worth a P3 alert.
        kept: Its name in the history, which keeps one a minute; None: keeps none.
        vital: Whether a STOP or a speed limit may rest on it.
    """

    of: type[Observation]
    ordered: Literal["counted", "by arrival"] = "counted"
    may_drop: bool = True
    lands: str | None = "sensed"
    touches: tuple[Topic, ...] = ()
    direct: Scope = "off"
    qos: int = 0
    apart_s: float = 0.0
    low: Low | None = None
    kept: str | None = None
    vital: bool = False


def _low_battery(battery: Battery) -> float | None:
    """State of charge that counts as low; a charging battery does not."""
    return None if battery.charging else battery.percentage


KINDS = (
    Kind(
        Odometry,
        lands="odometry",
        touches=(topics.ROBOT,),
        direct="all",
        vital=True,
    ),
    Kind(
        LaserScan,
        lands="scan",
        touches=(topics.SCAN,),
        direct="all",
        apart_s=SCANS_APART_S,
    ),
    Kind(
        DetectionFrame,
        may_drop=False,
        lands="frame",
        direct="safety",
        qos=1,
        vital=True,
    ),
    Kind(
        SafetyReport,
        may_drop=False,
        lands="safety",
        touches=(topics.ROBOT,),
        direct="safety",
        qos=1,
        vital=True,
    ),
    Kind(Navigation, lands="navigation", direct="all"),
    Kind(CommandStatus, ordered="by arrival", lands="command_status"),
    Kind(
        CommandAnswer,
        may_drop=False,
        lands=None,
        direct="safety",
        qos=1,
        vital=True,
    ),
    Kind(Climate, ordered="by arrival", lands="climate", touches=(topics.CLIMATE,)),
    Kind(HeartbeatProbe, ordered="by arrival", lands=None, vital=True),
    Kind(
        Battery,
        touches=(topics.ROBOT,),
        direct="all",
        low=Low("alert.battery_low", _low_battery, 0.20, 0.25, "level"),
        kept="battery",
    ),
)
_BY_TYPE = {kind.of: kind for kind in KINDS}


def kind(observation: Observation) -> Kind:
    """The row of an observation."""
    return _BY_TYPE[kind_of(observation)]


def may_drop(of: type[Observation]) -> bool:
    """Whether the oldest of a kind may be dropped; copies and refusals always may."""
    row = _BY_TYPE.get(of)
    return row is None or row.may_drop


def read_directly(scope: Scope) -> dict[type[Observation], Kind]:
    """Kinds that are read directly from MQTT in a scope."""
    most = _SCOPES[scope]
    return {
        row.of: row
        for row in KINDS
        if row.direct != "off" and _SCOPES[row.direct] <= most
    }


class LowValues:
    """Which robots have something low; hysteresis, so that no alert flaps."""

    def __init__(self) -> None:
        self._low: set[tuple[str, type[Observation]]] = set()

    def conditions(self, robot: RobotState) -> Iterable[Condition]:
        """Low values of one robot at present."""
        name = robot.robot_id
        for row in KINDS:
            read = robot.sensed.get(row.of)
            if row.low is None or read is None:
                continue
            value = row.low.value(read.observation)
            if value is not None and self._is_low((name, row.of), row.low, value):
                slots: dict[str, Slot] = {"robot": name, row.low.slot: round(value, 2)}
                yield Condition("P3", row.low.key, name, name, slots)

    def _is_low(
        self, key: tuple[str, type[Observation]], low: Low, value: float
    ) -> bool:
        is_low = value <= low.below or (key in self._low and value < low.above)
        (self._low.add if is_low else self._low.discard)(key)
        return is_low
