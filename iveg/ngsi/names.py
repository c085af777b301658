"""The fixed names of the wire: topics, attributes, devices, entities."""

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
"""Of the IoT Agent."""


def _attributes(of: type[Observation]) -> list[str]:
    return [name for name, _ in KIND_OF[of].attributes]


(ODOMETRY,) = _attributes(Odometry)
LIDAR, LIDAR_HEADER = _attributes(LaserScan)
BOXES, BOXES_HEADER = _attributes(DetectionFrame)
(SAFETY,) = _attributes(SafetyReport)
(NAVIGATION,) = _attributes(Navigation)
UNPLACED = "unplaced"
"""``frame_id`` of what a robot sensed without knowing where."""
COMMAND, COMMAND_STATUS, COMMAND_INFO = "cmd", "cmd_status", "cmd_info"
GOAL, GOAL_INFO = "goal", "goal_info"
COMMANDS = (COMMAND, GOAL)
"""NGSI commands of a robot, by what they carry: STOP and its end; goals."""
ALGORITHM_1 = {
    "class": "Text",
    "conf": "Number",
    "position_3D": "object",
    "pose": "object",
    "laser_scan": "array",
    "timestamp": "Text",
}
"""Attributes of the single payload, with their NGSI types."""

FEEDBACK_TOPIC = "/{robot_id}/mqtt_feedback"
FEEDBACK_FILTER = "/+/mqtt_feedback"
DESIRED_TOPIC = "/{robot_id}/iveg/desired"
PEER_SCAN_TOPIC = "/{robot_id}/iveg/peer_scan"
PEER_SCAN_FILTER = "/+/iveg/peer_scan"
PEER_SCAN_END = PEER_SCAN_FILTER.removeprefix("/+")


@dataclass(frozen=True, slots=True)
class RobotDevice:
    """One IoT Agent device: what it measures and whether it takes commands.

    Attributes:
        suffix: After the robot id in the device id and topic; empty for the robot.
        attributes: NGSI attribute name and type.
        of: What its measures observe; None for the device of everything.
    """

    suffix: str
    attributes: tuple[tuple[str, str], ...]
    of: type[Observation] | None = None

    @property
    def has_command(self) -> bool:
        """Whether the robot's orders go to it: the device of everything."""
        return self.of is None


ROBOT_DEVICES = (
    RobotDevice(
        "",
        (
            *ALGORITHM_1.items(),
            *(pair for kind in MEASURED for pair in kind.attributes),
        ),
    ),
    *(RobotDevice(kind.suffix or "", kind.attributes, kind.of) for kind in MEASURED),
)
"""The command device sorts before its sensors, and is provisioned last where the agent
keeps its registry in memory, so that either registry picks it (docs/fiware.md)."""


def measure_topic(apikey: str, device_id: str) -> str:
    """Topic of a device's measures."""
    return f"/{apikey}/{device_id}/attrs"


def direct_topic(robot_id: str, suffix: str) -> str:
    """Where a robot tells iVeg alone what its device ``suffix`` measures.

    The IoT Agent does not listen there (it does to ``/+/+/attrs`` and ``/+/+/cmdexe``),
    so it costs the agent nothing.
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
    """The robot that a device belongs to: ``AGI_odom`` → ``AGI``."""
    for device in ROBOT_DEVICES:
        if device.suffix and device_id.endswith(device.suffix):
            return device_id.removesuffix(device.suffix)
    return device_id


_HEADERS = {LIDAR: LIDAR_HEADER, BOXES: BOXES_HEADER}
"""Attributes whose origin keys stand in another one."""


def refuse_another_robot(
    robot_id: str, attributes: Mapping[str, object], name: str
) -> None:
    """Refuse what says that another robot sent it than its topic or entity does.

    Raises:
        UnreadableError: ``another_robot``.
    """
    value, header = attributes.get(name), attributes.get(_HEADERS.get(name, name))
    for part in (attributes, value, header):
        if isinstance(part, dict) and part.get("robot_id", robot_id) != robot_id:
            raise UnreadableError("another_robot", f"{name} names another robot")
