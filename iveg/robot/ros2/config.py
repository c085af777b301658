"""``robot.toml``: names of a robot's topics and frames, and its drive.

Absent keys have the defaults of ROS.  An invalid file is refused with key and reason.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Annotated

from pydantic import AfterValidator, Field

from iveg.adapters.toml_files import Table, complaint, read_table
from iveg.domain.errors import UnreadableError
from iveg.robot.ros2.topics import TOPICS
from iveg.ros2 import names
from iveg.ros2.names import Qos

_Speed = Annotated[float, Field(ge=0.05, le=5.0)]


@dataclass(frozen=True, slots=True)
class Frames:
    """Frame names (REP-105)."""

    map: str = "map"
    odom: str = "odom"
    base_link: str = "base_link"


class DriveConfig(Table):
    """The drive behind the gate.

    Attributes:
        stamped_in: Navigation sends ``TwistStamped``; ``stamped_out``: the base wants
            it.
        max_speed: (m/s); ``max_turn`` (rad/s).  None: the robot's profile.
    """

    stamped_in: bool = False
    stamped_out: bool = False
    max_speed: _Speed | None = None
    max_turn: _Speed | None = None


_NAMES = {key: topic.name for key, topic in TOPICS.items()}
_QUALITIES = {key: topic.qos for key, topic in TOPICS.items()}


@dataclass(frozen=True, slots=True)
class RobotConfig:
    """ROS 2 configuration of a robot.

    Attributes:
        domain: ``ROS_DOMAIN_ID``, 0 to 232.
        interface: Network interface; empty: any.
        peers: Addresses for discovery without multicast; empty: multicast.
        tf_max_age_s: Greatest age of a transform (s).
        class_list: File with a detector's class names, one a line; empty: as sent.
        p_min: Least probability of a detection that is located by depth.
        topics: Names by key of ``TOPICS``, as in ROS nodes; empty: none.
        qualities: Quality of service by the same.
    """

    domain: int = 0
    namespace: str = ""
    interface: str = ""
    peers: tuple[str, ...] = ()
    topics: Mapping[str, str] = field(default_factory=lambda: dict(_NAMES))
    frames: Frames = Frames()
    drive: DriveConfig = field(default_factory=DriveConfig)
    tf_max_age_s: float = 0.5
    class_list: str = ""
    p_min: float = 0.8
    qualities: Mapping[str, Qos] = field(default_factory=lambda: dict(_QUALITIES))

    @property
    def full_topics(self) -> dict[str, str]:
        """The topics by their full names.

        Raises:
            UnreadableError: a name is not a ROS topic.
        """
        return {
            topic: names.full_name(name, self.namespace) if name else ""
            for topic, name in self.topics.items()
        }


# --- the shape of the file --------------------------------------------------------


def _checked_topic(text: str) -> str:
    try:
        if text:
            names.full_name(text)
    except UnreadableError as error:
        raise ValueError(error.detail) from error
    return text


_Text = Annotated[str, Field(max_length=256)]
_Topic = Annotated[_Text, AfterValidator(_checked_topic)]
_Frame = Annotated[
    str,
    Field(pattern=r"^/?[A-Za-z0-9_][A-Za-z0-9_/.-]{0,127}$"),
    AfterValidator(lambda name: name.lstrip("/")),
]
_Address = Annotated[_Text, Field(min_length=1)]


class _Ros(Table):
    domain: Annotated[int, Field(ge=0, le=232)] = 0
    namespace: _Topic = ""
    interface: _Text = ""
    peers: list[_Address] = Field(default_factory=list, max_length=64)


class _Transforms(Table):
    max_age_s: Annotated[float, Field(ge=0.05, le=5.0)] = 0.5


class _Detector(Table):
    classes: _Text = ""
    p_min: Annotated[float, Field(ge=0.0, le=1.0)] = 0.8


class _Quality(Table):
    reliable: bool = True
    transient_local: bool = False
    depth: Annotated[int, Field(ge=1, le=1000)] = 10


class _FileTable(Table):
    ros: _Ros = _Ros()
    topics: dict[str, _Topic] = Field(default_factory=dict)
    frames: dict[str, _Frame] = Field(default_factory=dict)
    drive: DriveConfig = DriveConfig()
    transforms: _Transforms = _Transforms()
    detector: _Detector = _Detector()
    qos: dict[str, _Quality] = Field(default_factory=dict)


_FRAMES = [one.name for one in fields(Frames)]
_KNOWN = {"topics": TOPICS, "frames": _FRAMES, "qos": TOPICS}

# --- the file -----------------------------------------------------------------------


def read_config(text: str, file: str) -> RobotConfig:
    """Read ``robot.toml``; ``file`` is its name in error messages.

    Raises:
        DataFileError: naming file, key and reason.
    """
    page = read_table(text, file, _FileTable)
    for name, known in _KNOWN.items():
        for key in getattr(page, name):
            if key not in known:
                reason = f"is unknown; known are {', '.join(known)}"
                raise complaint(file, (name, key), reason)
    return RobotConfig(
        domain=page.ros.domain,
        namespace=page.ros.namespace,
        interface=page.ros.interface,
        peers=tuple(page.ros.peers),
        topics=_NAMES | page.topics,
        frames=Frames(**page.frames),
        drive=page.drive,
        tf_max_age_s=page.transforms.max_age_s,
        class_list=page.detector.classes,
        p_min=page.detector.p_min,
        qualities=_QUALITIES
        | {
            topic: replace(_QUALITIES[topic], **said.model_dump(exclude_unset=True))
            for topic, said in page.qos.items()
        },
    )
