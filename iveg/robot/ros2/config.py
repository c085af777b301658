"""``robot.toml``: names of a robot's topics and frames, and its drive.

Absent keys have the defaults of ROS.  An invalid file is refused with line, key and
reason.
"""

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

from iveg.adapters.toml_positions import place_of
from iveg.domain.errors import DataFileError, UnreadableError
from iveg.ros2 import names
from iveg.ros2.names import Qos

_MOST_PEERS = 64
_LONGEST = 256
_FRAME = re.compile(r"/?[A-Za-z0-9_][A-Za-z0-9_/.-]{0,127}")


@dataclass(frozen=True, slots=True)
class Topics:
    """Names of topics as in ROS nodes: relative ones are below the namespace.

    Attributes:
        detections_2d: With ``depth`` and ``camera_info`` an alternative to
            ``detections_3d``; empty: none.
        mask: A mono picture in which value n marks the n-th detection; empty: the
            whole box is used.
        obstacles: Output of people and peers for Nav2's obstacle layer.
        markers: Output of the same for RViz.
    """

    odometry: str = "odom"
    scan: str = "scan"
    tf: str = "tf"
    tf_static: str = "tf_static"
    detections_3d: str = "detections_3d"
    detections_2d: str = ""
    depth: str = "camera/aligned_depth_to_color/image_raw"
    camera_info: str = "camera/color/camera_info"
    mask: str = ""
    battery: str = "battery_state"
    path: str = "plan"
    cmd_vel_in: str = "cmd_vel_nav"
    cmd_vel_out: str = "cmd_vel"
    obstacles: str = "iveg/obstacles"
    markers: str = "iveg/markers"


@dataclass(frozen=True, slots=True)
class Frames:
    """Frame names (REP-105)."""

    map: str = "map"
    odom: str = "odom"
    base_link: str = "base_link"


@dataclass(frozen=True, slots=True)
class DriveConfig:
    """The drive behind the gate.

    Attributes:
        stamped_in: Navigation sends ``TwistStamped``; ``stamped_out``: the base wants
            it.
        max_speed: (m/s); ``max_turn`` (rad/s).  None: the robot's profile.
    """

    stamped_in: bool = False
    stamped_out: bool = False
    max_speed: float | None = None
    max_turn: float | None = None


_QUALITIES: dict[str, Qos] = {
    "odometry": names.SENSOR_DATA,
    "scan": names.SENSOR_DATA,
    "tf": names.TF,
    "tf_static": names.TF_STATIC,
    "detections_3d": names.SENSOR_DATA,
    "detections_2d": names.SENSOR_DATA,
    "depth": names.SENSOR_DATA,
    "camera_info": names.SENSOR_DATA,
    "mask": names.SENSOR_DATA,
    "battery": names.SENSOR_DATA,
    "path": names.SENSOR_DATA,
    "cmd_vel_in": names.SENSOR_DATA,
    "cmd_vel_out": names.DEFAULT,
    "obstacles": names.DEFAULT,
    "markers": names.DEFAULT,
}
"""A best-effort reader matches every writer; only commands are read reliably."""


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
        qualities: Quality of service by topic.
    """

    domain: int = 0
    namespace: str = ""
    interface: str = ""
    peers: tuple[str, ...] = ()
    topics: Topics = Topics()
    frames: Frames = Frames()
    drive: DriveConfig = DriveConfig()
    tf_max_age_s: float = 0.5
    class_list: str = ""
    p_min: float = 0.8
    qualities: Mapping[str, Qos] = field(default_factory=lambda: dict(_QUALITIES))

    @property
    def full_topics(self) -> Topics:
        """The topics by their full names.

        Raises:
            UnreadableError: a name is not a ROS topic.
        """
        return Topics(
            **{
                topic: names.full_name(name, self.namespace) if name else ""
                for topic, name in asdict(self.topics).items()
            }
        )


def read_config(text: str, file: str) -> RobotConfig:
    """Read ``robot.toml``; ``file`` is its name in error messages.

    Raises:
        DataFileError: naming line, key and reason.
    """
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"at line (\d+)", str(error))
        where = f"line {found[1]}" if found else f"line {text.count(chr(10)) + 1}"
        raise DataFileError(file, where, f"is not TOML: {error}.") from error
    page = _Page(file, text)
    for name, value in raw.items():
        if name not in _SECTIONS:
            known = ", ".join(_SECTIONS)
            raise page.refuse("", name, f"is unknown; known are {known}.")
        if not isinstance(value, dict):
            raise page.refuse("", name, "must be a table.")
    return _read(page, raw)


_SECTIONS = ("ros", "topics", "frames", "drive", "transforms", "detector", "qos")


def _read(page: "_Page", raw: Mapping[str, Any]) -> RobotConfig:
    ros = _Table(page, raw, "ros", ("domain", "namespace", "interface", "peers"))
    transforms = _Table(page, raw, "transforms", ("max_age_s",))
    detector = _Table(page, raw, "detector", ("classes", "p_min"))
    drive = _Table(
        page, raw, "drive", ("stamped_in", "stamped_out", "max_speed", "max_turn")
    )
    return RobotConfig(
        domain=int(ros.number("domain", 0, 232, 0, whole=True)),
        namespace=ros.get("namespace", "", _topic),
        interface=ros.get("interface", "", _maybe_text),
        peers=ros.get("peers", (), _peers),
        topics=Topics(**_texts(page, raw, "topics", Topics, _topic)),
        frames=Frames(**_texts(page, raw, "frames", Frames, _frame)),
        drive=DriveConfig(
            drive.get("stamped_in", False, _flag),
            drive.get("stamped_out", False, _flag),
            drive.maybe("max_speed", 0.05, 5.0),
            drive.maybe("max_turn", 0.05, 5.0),
        ),
        tf_max_age_s=transforms.number("max_age_s", 0.05, 5.0, 0.5),
        class_list=detector.get("classes", "", _maybe_text),
        p_min=detector.number("p_min", 0.0, 1.0, 0.8),
        qualities=_qualities(page, raw),
    )


def _texts(
    page: "_Page",
    raw: Mapping[str, Any],
    section: str,
    kind: type[Any],
    read: Callable[[Any], str],
) -> dict[str, str]:
    keys = tuple(one.name for one in fields(kind))
    table = _Table(page, raw, section, keys)
    return {key: table.get(key, "", read) for key in keys if key in table.raw}


def _qualities(page: "_Page", raw: Mapping[str, Any]) -> dict[str, Qos]:
    table = _Table(page, raw, "qos", tuple(_QUALITIES))
    found = dict(_QUALITIES)
    for topic in table.raw:
        found[topic] = replace(found[topic], **table.get(topic, {}, _quality))
    return found


# --- one table of the file ---------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Page:
    """Text of the file, to find the line of an error."""

    file: str
    text: str

    def refuse(self, section: str, key: str, reason: str) -> DataFileError:
        """The error about one key."""
        path = (section, key) if section else (key,)
        line, _ = place_of(self.text, path)
        return DataFileError(self.file, f"line {line}, {'.'.join(path)}", reason)


@dataclass(frozen=True, slots=True)
class _Table:
    """One table, read key by key; an unknown key is an error."""

    page: _Page
    root: Mapping[str, Any]
    section: str
    keys: tuple[str, ...]

    def __post_init__(self) -> None:
        for key in self.raw:
            if key not in self.keys:
                known = ", ".join(self.keys)
                reason = f"is unknown; known are {known}."
                raise self.page.refuse(self.section, key, reason)

    @property
    def raw(self) -> Mapping[str, Any]:
        """Content of the table in the file."""
        table: Mapping[str, Any] = self.root.get(self.section, {})
        return table

    def get(self, key: str, default: Any, read: Callable[[Any], Any]) -> Any:
        """A value converted by ``read``, which raises ValueError for an invalid one."""
        if key not in self.raw:
            return default
        try:
            return read(self.raw[key])
        except ValueError as error:
            raise self.page.refuse(self.section, key, f"{error}.") from error

    def number(
        self,
        key: str,
        least: float,
        most: float,
        default: float,
        *,
        whole: bool = False,
    ) -> float:
        """A number within bounds."""
        kinds = (int,) if whole else (int, float)

        def read(value: Any) -> float:
            good = isinstance(value, kinds) and not isinstance(value, bool)
            if not good or not least <= value <= most:
                a = "a whole number" if whole else "a number"
                raise ValueError(f"must be {a} from {least:g} to {most:g}")
            return float(value)

        return float(self.get(key, default, read))

    def maybe(self, key: str, least: float, most: float) -> float | None:
        """A number within bounds, or None if absent."""
        return self.number(key, least, most, 0.0) if key in self.raw else None


def _text(value: Any) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= _LONGEST:
        raise ValueError(f"must be a text of 1 to {_LONGEST} characters")
    return value


def _maybe_text(value: Any) -> str:
    return "" if value == "" else _text(value)


def _topic(value: Any) -> str:
    if value == "":
        return ""
    try:
        names.full_name(_text(value))
    except UnreadableError as error:
        raise ValueError(f"{error.detail}") from error
    return str(value)


def _frame(value: Any) -> str:
    if _FRAME.fullmatch(_text(value)) is None:
        raise ValueError("must name a frame")
    return str(value).lstrip("/")


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError("must be true or false")
    return value


def _peers(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > _MOST_PEERS:
        raise ValueError(f"must be a list of at most {_MOST_PEERS} addresses")
    return tuple(_text(one) for one in value)


def _quality(value: Any) -> dict[str, object]:
    kinds: dict[str, type] = {"reliable": bool, "transient_local": bool, "depth": int}
    if not isinstance(value, dict) or not value.keys() <= kinds.keys():
        raise ValueError(f"must be a table of {', '.join(kinds)}")
    for key, one in value.items():
        if type(one) is not kinds[key]:
            raise ValueError(f"{key} must be a {kinds[key].__name__}")
    if not 1 <= value.get("depth", 1) <= 1000:
        raise ValueError("depth must be from 1 to 1000")
    return dict(value)


def read_classes(text: str) -> tuple[str, ...]:
    """A detector's class names, one per line, in the order of their numbers."""
    return tuple(line.strip() for line in text.splitlines() if line.strip())
