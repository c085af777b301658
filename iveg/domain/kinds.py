"""The kinds of observation: one row each, from which all else of a kind follows.

Device, topics, subscription, order, history, alert, REST member and the row on a card
are read from here; nothing is guessed from a class's name.  What a small sensor's value
is stands in its observation (``quantity``), so it needs no reader and no writer of its
own; kinds with a shape of their own have theirs in ``iveg.ngsi.codec``.
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
"""What is read directly from MQTT beside FIWARE: each is part of the next."""
SCANS_APART_S = 0.045
"""A page draws 15 a second and the costmap 4; of 30 that come every second is read."""


@dataclass(frozen=True, slots=True)
class Low:
    """A value of a small sensor that raises the P3 alert ``alert.{name}_low``.

    Attributes:
        value: Name of the quantity.
        below: Raised at or below this, cleared at or above ``above``.
        unless: Name of a flag under which a low value is nothing wrong.
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
        every_s: How often a robot sends it (s).
        kept_every_s: The history keeps one of this time (s).
        low: When it is worth an alert.
    """

    shown: str
    every_s: float = 5.0
    kept_every_s: float = 60.0
    low: Low | None = None


@dataclass(frozen=True, slots=True)
class Kind:
    """One row.

    Attributes:
        of: The observation.
        name: In subscriptions, history, REST, live, and keys of translations.
        suffix: Of its device and topics, after the robot's id; None: no device of its
            own.
        attributes: Of the robot's entity, with their NGSI types.  The origin stands in
            the last object.
        speaks_alone: Whether its device may also speak to iVeg alone, past the agent.
        floor_hz: Least rate through the agent while Orion is behind; None: its own.
        ordered: By the robot's own count, or by arrival.
        lands: Member of ``RobotState`` or ``World`` that keeps the newest; None for an
            event: the machine of its command or the health monitor takes it.
        changes: Live topic that is new with it; those of detections depend on what is
            seen, those of a command on the machine.
        direct: From which scope on it is read straight from MQTT; ``off`` never.
        qos: There.
        apart_s: There, least time between two of a robot that are read (s).
        vital: Whether a STOP or a speed limit may rest on it.
        sensor: What is shown and kept of it, for a small sensor.
    """

    of: type[Observation]
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


def _sensed(of: type[Observation], name: str, sensor: Sensor) -> Kind:
    """The row of a small sensor: all that is alike for each of them."""
    return Kind(
        of,
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

KIND_OF: Mapping[type[Observation], Kind] = {kind.of: kind for kind in KINDS}
MEASURED = tuple(kind for kind in KINDS if kind.suffix is not None)
"""Kinds that a robot has a device for."""
SENSED = tuple(kind for kind in KINDS if kind.sensor is not None)
"""Small sensors."""


def row_of(of: type[Observation]) -> Kind:
    """The row of a kind.

    Raises:
        LookupError: it has none.
    """
    if of not in KIND_OF:
        raise LookupError(f"{of.__name__} has no row in iveg/domain/kinds.py")
    return KIND_OF[of]


def kind(observation: Observation) -> Kind:
    """The row of an observation."""
    return KIND_OF[kind_of(observation)]
