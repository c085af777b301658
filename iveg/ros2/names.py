"""ROS 2 names on DDS, and the default quality of service of ROS.

Source: ROS 2 design, "Topic and Service name mapping to DDS", and the profiles of
``rmw`` and ``tf2_ros``.
"""

import re
from dataclasses import dataclass, replace

from iveg.domain.errors import UnreadableError

_PREFIX = "rt"
_NAME = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


@dataclass(frozen=True, slots=True)
class Qos:
    """Quality of service that an endpoint requests or offers.

    Attributes:
        reliable: Lost samples are sent again; else best effort.
        transient_local: Late readers get earlier samples; else volatile.
        depth: Number of newest messages kept for reading.
    """

    reliable: bool = True
    transient_local: bool = False
    depth: int = 10

    def lacks(self, offered: "Qos") -> str:
        """Difference of a writer's offer from this request; empty: they match."""
        if self.reliable and not offered.reliable:
            return "best effort → reliable"
        if self.transient_local and not offered.transient_local:
            return "volatile → transient local"
        return ""

    def __str__(self) -> str:
        """Text for the table of ``iveg robot check``."""
        kept = ", kept" if self.transient_local else ""
        return ("reliable" if self.reliable else "best effort") + kept

    def newest(self, depth: int = 1) -> "Qos":
        """This quality of service with another depth."""
        return replace(self, depth=depth)


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A writer or reader on the domain.

    Attributes:
        topic: Full ROS name.
        type: ROS name, such as ``nav_msgs/msg/Odometry``.
        writes: It is a writer, else a reader.
        qos: Quality of service that it offers or requests.
        own: It is of this process.
        type_hash: As announced, ``RIHS01_…``; empty before ROS 2 Iron.
        gate: Id of the robot whose gate has it; empty: no gate of iVeg.
    """

    topic: str
    type: str
    writes: bool
    qos: Qos
    own: bool
    type_hash: str = ""
    gate: str = ""

    def writes_to(self, topic: str) -> bool:
        """Whether it is a writer of this topic."""
        return self.writes and self.topic == topic


DEFAULT = Qos()
SENSOR_DATA = Qos(reliable=False, depth=5)
TF = Qos(depth=100)
LATCHED = Qos(transient_local=True, depth=1)
"""For maps: a late reader gets the newest."""
TF_STATIC = Qos(transient_local=True, depth=100)


def full_name(name: str, namespace: str = "") -> str:
    """A topic's full ROS name: ``odom`` is below the namespace, ``/odom`` is not.

    Raises:
        UnreadableError: not a name of a ROS topic.
    """
    inside = namespace.strip("/")
    full = name if name.startswith("/") or not inside else f"/{inside}/{name}"
    if _NAME.fullmatch(full) is None:
        raise UnreadableError("bad_topic", f"{full!r} is not a ROS topic")
    return full if full.startswith("/") else f"/{full}"


def namespace_of(robot_id: str) -> str:
    """A ROS name for a robot: ``AGI-2`` → ``agi_2``."""
    name = robot_id.lower().replace("-", "_")
    return name if name[0].isalpha() else f"r{name}"


def dds_topic(name: str) -> str:
    """The DDS topic of a full ROS name: ``/odom`` → ``rt/odom``."""
    return _PREFIX + name


def ros_topic(dds: str) -> str | None:
    """The ROS name of a DDS topic; None for other topics."""
    return dds.removeprefix(_PREFIX) if dds.startswith(_PREFIX + "/") else None


def dds_type(ros: str) -> str:
    """The DDS type: ``nav_msgs/msg/Odometry`` → ``nav_msgs::msg::dds_::Odometry_``."""
    *package, name = ros.split("/")
    return "::".join((*package, "dds_", name + "_"))


def ros_type(dds: str) -> str:
    """The ROS name of a DDS type; a type of another origin stays as it is."""
    return dds.replace("::dds_::", "::").removesuffix("_").replace("::", "/")
