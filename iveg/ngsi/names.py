"""Fixed names of the wire: topics, attributes, devices, entities."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from iveg.domain.errors import UnreadableError
from iveg.domain.kinds import KIND_OF, MEASURED
from iveg.domain.observations import (
    DetectionFrame,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    SafetyReport,
)

ROBOT_TYPE = "Robot"
CLIMATE_ID, CLIMATE_TYPE = "greenhouse-climate", "IndoorEnvironmentObserved"
HEARTBEAT_ID, HEARTBEAT_TYPE = "iveg-canary", "Probe"
CLIMATE_DEVICE = "climate"
PROTOCOL = "JSON"
"""Protocol of the IoT Agent."""


def _attributes(observation: type[Observation]) -> list[str]:
    return [name for name, _ in KIND_OF[observation].attributes]


(ODOMETRY,) = _attributes(Odometry)
LIDAR, LIDAR_HEADER = _attributes(LaserScan)
BOXES, BOXES_HEADER = _attributes(DetectionFrame)
(SAFETY,) = _attributes(SafetyReport)
(NAVIGATION,) = _attributes(Navigation)
UNPLACED = "unplaced"
"""``frame_id`` of data that a robot sensed without a pose."""
COMMAND, COMMAND_STATUS, COMMAND_INFO = "cmd", "cmd_status", "cmd_info"
GOAL, GOAL_INFO = "goal", "goal_info"
COMMANDS = (COMMAND, GOAL)
"""NGSI commands of a robot: STOP, release and resume; goals."""
ALGORITHM_1 = {
    "class": "Text",
    "conf": "Number",
    "position_3D": "object",
    "pose": "object",
    "laser_scan": "array",
    "timestamp": "Text",
}
"""Attributes of Algorithm 1's single payload, with their NGSI types."""

FEEDBACK_TOPIC = "/{robot_id}/mqtt_feedback"
FEEDBACK_FILTER = "/+/mqtt_feedback"
DESIRED_TOPIC = "/{robot_id}/iveg/desired"
PEER_SCAN_TOPIC = "/{robot_id}/iveg/peer_scan"
PEER_SCAN_FILTER = "/+/iveg/peer_scan"
PEER_SCAN_END = PEER_SCAN_FILTER.removeprefix("/+")


@dataclass(frozen=True, slots=True)
class RobotDevice:
    """IoT Agent device of a robot: its measures and whether it takes commands.

    Attributes:
        suffix: Text after the robot id in device id and topic; empty for the robot.
        attributes: Names and NGSI types of the attributes.
        observation: Kind of its measures; None for the device of all kinds.
    """

    suffix: str
    attributes: tuple[tuple[str, str], ...]
    observation: type[Observation] | None = None

    @property
    def has_command(self) -> bool:
        """Whether it takes the robot's orders; the device of all kinds does."""
        return self.observation is None


ROBOT_DEVICES = (
    RobotDevice(
        "",
        (
            *ALGORITHM_1.items(),
            *(pair for kind in MEASURED for pair in kind.attributes),
        ),
    ),
    *(RobotDevice(kind.suffix or "", kind.attributes, kind.type_) for kind in MEASURED),
)
"""Command device first.  It sorts before its sensors, for an agent with MongoDB, and is
provisioned last, for one with its registry in memory: both pick it (docs/fiware.md)."""


def measure_topic(apikey: str, device_id: str) -> str:
    """Topic of a device's measures."""
    return f"/{apikey}/{device_id}/attrs"


def direct_topic(robot_id: str, suffix: str) -> str:
    """Topic of a device's measures for iVeg alone.

    The IoT Agent subscribes to ``/+/+/attrs`` and ``/+/+/cmdexe``, so that this topic
    costs the agent nothing.
    """
    return f"/{robot_id}/iveg/{suffix.removeprefix('_')}"


def command_topic(apikey: str, robot_id: str) -> str:
    """Topic of a robot's commands."""
    return f"/{apikey}/{robot_id}/cmd"


def answer_topic(apikey: str, robot_id: str) -> str:
    """Topic of a robot's answers."""
    return f"/{apikey}/{robot_id}/cmdexe"


@lru_cache(maxsize=1024)
def robot_of_device(device_id: str) -> str:
    """Robot of a device: ``AGI_odom`` → ``AGI``."""
    for device in ROBOT_DEVICES:
        if device.suffix and device_id.endswith(device.suffix):
            return device_id.removesuffix(device.suffix)
    return device_id


HEADERS = {LIDAR: LIDAR_HEADER, BOXES: BOXES_HEADER}
"""Attributes whose origin keys stand in another attribute."""


def refuse_another_robot(
    robot_id: str, attributes: Mapping[str, object], name: str
) -> None:
    """Refuse a message that names another robot than its topic or entity does.

    Raises:
        UnreadableError: ``another_robot``.
    """
    value, header = attributes.get(name), attributes.get(HEADERS.get(name, name))
    for part in (attributes, value, header):
        if isinstance(part, dict) and part.get("robot_id", robot_id) != robot_id:
            raise UnreadableError("another_robot", f"{name} names another robot")
