"""``robot.toml``: names of a robot's topics and frames, and its drive.

Absent keys have the defaults of ROS.  An invalid file is refused with key and reason.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationError

from iveg.adapters.toml_files import Table, complaint, read_table
from iveg.domain.errors import UnreadableError
from iveg.robot.ros2.topics import TOPICS
from iveg.ros2 import names
from iveg.ros2.names import Qos


def _checked_topic(text: str) -> str:
    try:
        if text:
            names.full_name(text)
    except UnreadableError as error:
        raise ValueError(error.detail) from error
    return text


def _known_key(key: str) -> str:
    if key not in TOPICS:
        raise ValueError(f"is unknown; known are {', '.join(TOPICS)}")
    return key


_Text = Annotated[str, Field(max_length=256)]
_Name = Annotated[_Text, AfterValidator(_checked_topic)]
_Key = Annotated[str, AfterValidator(_known_key)]
_Frame = Annotated[
    str,
    Field(pattern=r"^/?[A-Za-z0-9_][A-Za-z0-9_/.-]{0,127}$"),
    AfterValidator(lambda name: name.lstrip("/")),
]
_Address = Annotated[_Text, Field(min_length=1)]
_Speed = Annotated[float, Field(ge=0.05, le=5.0)]


class RosTable(Table):
    """Network of the robot.

    Attributes:
        domain: ``ROS_DOMAIN_ID``.
        namespace: Relative names of topics are below it.
        interface: Network interface; empty: any.
        peers: Addresses for discovery without multicast; empty: multicast.
    """

    domain: Annotated[int, Field(ge=0, le=232)] = 0
    namespace: _Name = ""
    interface: _Text = ""
    peers: Annotated[tuple[_Address, ...], Field(strict=False, max_length=64)] = ()


class Frames(Table):
    """Frame names (REP-105)."""

    map: _Frame = "map"
    odom: _Frame = "odom"
    base_link: _Frame = "base_link"


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


class TransformsTable(Table):
    """Greatest age of a transform (s)."""

    max_age_s: Annotated[float, Field(ge=0.05, le=5.0)] = 0.5


class DetectorTable(Table):
    """The detector.

    Attributes:
        classes: Unused, so that older files are read; the fleet file names classes.
        p_min: Least probability of a detection that is located by depth.
    """

    classes: _Text = ""
    p_min: Annotated[float, Field(ge=0.0, le=1.0)] = 0.8


class QualityTable(Table):
    """Quality of service of a topic; an absent key has the topic's default."""

    reliable: bool = True
    transient_local: bool = False
    depth: Annotated[int, Field(ge=1, le=1000)] = 10


class RobotConfig(Table):
    """ROS 2 configuration of a robot.

    Attributes:
        topics: Names by key of ``TOPICS``, as in ROS nodes; empty: none.
        qos: Quality of service by the same keys.
    """

    ros: RosTable = RosTable()
    topics: Mapping[_Key, _Name] = {}
    frames: Frames = Frames()
    drive: DriveConfig = DriveConfig()
    transforms: TransformsTable = TransformsTable()
    detector: DetectorTable = DetectorTable()
    qos: Mapping[_Key, QualityTable] = {}

    @property
    def full_topics(self) -> dict[str, str]:
        """Full names of all topics by key; empty: none."""
        given = {key: self.topics.get(key, topic.name) for key, topic in TOPICS.items()}
        return {
            key: names.full_name(name, self.ros.namespace) if name else ""
            for key, name in given.items()
        }

    def quality(self, topic: str) -> Qos:
        """Quality of service of a topic by its key."""
        given = self.qos.get(topic)
        changed = {} if given is None else given.model_dump(exclude_unset=True)
        return replace(TOPICS[topic].qos, **changed)

    def with_words(
        self, ros: Mapping[str, Any], topics: Mapping[str, str]
    ) -> "RobotConfig":
        """The configuration with words of the command line.

        Raises:
            DataFileError: naming key and reason.
        """
        tables = self.model_dump(exclude_unset=True)
        tables["ros"] = tables.get("ros", {}) | dict(ros)
        tables["topics"] = tables.get("topics", {}) | dict(topics)
        try:
            return RobotConfig.model_validate(tables)
        except ValidationError as error:
            first = error.errors()[0]
            raise complaint("command line", first["loc"], first["msg"]) from error


def read_config(text: str, file: str) -> RobotConfig:
    """Read ``robot.toml``; ``file`` is its name in error messages.

    Raises:
        DataFileError: naming file, key and reason.
    """
    return read_table(text, file, RobotConfig)
