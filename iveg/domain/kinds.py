"""Kinds of observation: one row each.

Device, topics, subscription, order, history, alert, REST member and the row on a card
follow from this row, never from a class's name.  The observation of a small sensor
declares its quantities (``domain.quantities``), so it needs no reader and no
writer of its own.  Kinds with a shape of their own have theirs in ``iveg.ngsi.codec``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from iveg.domain.observations import (
    Battery,
    Climate,
    CommandAnswer,
    CommandStatus,
    DetectionFrame,
    GoalAnswer,
    HeartbeatProbe,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    SafetyReport,
    kind_of,
)

Scope = Literal["off", "safety", "all"]
"""Extent of reading MQTT directly beside FIWARE; each includes the one before."""
SCANS_APART_S = 0.045
"""Least time between scans that are read (s): a page draws 15 a second."""


@dataclass(frozen=True, slots=True)
class Low:
    """A value of a small sensor that raises the P3 alert ``alert.{name}_low``.

    Attributes:
        value: Name of the quantity.
        below: Raised at or below this, cleared at or above ``above``.
        unless: Name of a flag under which a low value is no fault.
    """

    value: str
    below: float
    above: float
    unless: str | None = None


@dataclass(frozen=True, slots=True)
class Sensor:
    """Display and storage of a small sensor, whose value is one flat object.

    Attributes:
        shown: Name of the quantity on the card (``robot.{name}_level``; while a flag
            of the sensor is true, ``robot.{name}_{flag}``).
        every_s: Time between its messages (s).
        kept_every_s: Time between its rows in the history (s).
        low: Bounds of its alert; None: it raises none.
    """

    shown: str
    every_s: float = 5.0
    kept_every_s: float = 60.0
    low: Low | None = None


@dataclass(frozen=True, slots=True)
class Kind:
    """One row: a kind of observation.

    Attributes:
        type_: Type of the observation.
        name: Its name in subscriptions, history, REST, live and translations.
        suffix: End of its device's id and its topics, after the robot's id; None: no
            device of its own.
        attributes: Its attributes of the robot's entity, with their NGSI types.  The
            origin is in the last object.
        speaks_alone: Whether its device may also speak to iVeg alone, past the agent.
        floor_hz: Least rate through the agent while Orion is behind (Hz); None: any.
        ordered: Order of its messages: the robot's own count, or arrival.
        lands: Member of ``RobotState`` or ``World`` that keeps the newest; None for an
            event, which the machine of its command or the health monitor takes.
        changes: Live topic that is new with it; detections and commands change further
            topics by their content.
        direct: Least scope in which it is read straight from MQTT; ``off``: never.
        qos: MQTT quality of service of that direct topic.
        apart_s: Least time between two of a robot that are read directly (s).
        vital: Whether a STOP or a speed limit may rest on it.
        sensor: Display and storage of a small sensor; None for other kinds.
    """

    type_: type[Observation]
    name: str
    suffix: str | None = None
    attributes: tuple[tuple[str, str], ...] = ()
    speaks_alone: bool = False
    floor_hz: float | None = None
    ordered: Literal["counted", "by arrival"] = "counted"
    lands: str | None = None
    changes: Literal["robot", "scan", "climate"] | None = None
    direct: Scope = "off"
    qos: int = 0
    apart_s: float = 0.0
    vital: bool = False
    sensor: Sensor | None = None


def _sensed(type_: type[Observation], name: str, sensor: Sensor) -> Kind:
    """Row of a small sensor, with the common values of all small sensors."""
    return Kind(
        type_,
        name,
        f"_{name}",
        ((name, "object"),),
        lands="sensed",
        changes="robot",
        direct="all",
        sensor=sensor,
    )


KINDS = (
    Kind(
        Odometry,
        "odometry",
        "_odom",
        (("base_pose_ground_truth", "object"),),
        speaks_alone=True,
        floor_hz=5.3,
        lands="odometry",
        changes="robot",
        direct="all",
        vital=True,
    ),
    Kind(
        LaserScan,
        "lidar",
        "_lidar2D",
        (("lidar_points", "array"), ("lidar_header", "object")),
        speaks_alone=True,
        floor_hz=1.05,
        lands="scan",
        changes="scan",
        direct="all",
        apart_s=SCANS_APART_S,
        # Not vital: laser tracks rest on robots' reports, and scans feed the costmap.
    ),
    Kind(
        DetectionFrame,
        "detections",
        "_yolox_bounding_boxes",
        (("bounding_boxes", "object"), ("detection_header", "object")),
        speaks_alone=True,
        floor_hz=3.2,
        lands="frame",
        direct="safety",
        qos=1,
        vital=True,
    ),
    Kind(
        SafetyReport,
        "safety",
        "_safety",
        (("safety_state", "object"),),
        speaks_alone=True,
        lands="safety",
        changes="robot",
        direct="safety",
        qos=1,
        vital=True,
    ),
    Kind(
        Navigation,
        "navigation",
        "_nav",
        (("navigation", "object"),),
        lands="navigation",
        direct="all",
    ),
    _sensed(
        Battery,
        "battery",
        Sensor(
            shown="percentage",
            low=Low("percentage", below=0.20, above=0.25, unless="charging"),
        ),
    ),
    # The agent writes it, so it has no count of the robot.
    Kind(CommandStatus, "command_status", ordered="by arrival", lands="command_status"),
    Kind(
        CommandAnswer,
        "answer",
        direct="safety",
        qos=1,
        vital=True,
    ),
    Kind(GoalAnswer, "goal_answer", direct="safety", qos=1),
    Kind(Climate, "climate", ordered="by arrival", lands="climate", changes="climate"),
    Kind(HeartbeatProbe, "heartbeat", ordered="by arrival", vital=True),
)
"""A floor is a little above the contract's 1, 3 and 5 Hz, so that a late timer still
keeps it."""

KIND_OF: Mapping[type[Observation], Kind] = {kind.type_: kind for kind in KINDS}
MEASURED = tuple(kind for kind in KINDS if kind.suffix is not None)
"""Kinds for which a robot has a device."""
SENSED = tuple(kind for kind in KINDS if kind.sensor is not None)
"""Kinds of small sensors."""


def row_of(type_: type[Observation]) -> Kind:
    """Row of a type of observation.

    Raises:
        LookupError: it has none.
    """
    if type_ not in KIND_OF:
        raise LookupError(f"{type_.__name__} has no row in iveg/domain/kinds.py")
    return KIND_OF[type_]


def kind(observation: Observation) -> Kind:
    """Row of an observation."""
    return KIND_OF[kind_of(observation)]
