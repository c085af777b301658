"""``robot.toml``: names of a robot's topics and frames, and its drive.

Absent keys have the defaults of ROS.  An invalid file is refused with line, key and
reason.
"""

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from iveg.adapters.toml_positions import place_of, syntax_error
from iveg.domain.errors import DataFileError, UnreadableError
from iveg.robot.ros2.topics import TOPICS
from iveg.ros2 import names
from iveg.ros2.names import Qos

_MOST_PEERS = 64
_LONGEST = 256
_LAST_DOMAIN = 232
_FRAME = re.compile(r"/?[A-Za-z0-9_][A-Za-z0-9_/.-]{0,127}")


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
    drive: DriveConfig = DriveConfig()
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


# --- values -------------------------------------------------------------------------

_Reader = Callable[[object], object]
"""Checks and converts a value; raises ValueError with what it must be."""


def _table(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError("must be a table")
    return value


def _number(least: float, most: float) -> _Reader:
    def read(value: Any) -> float:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not least <= value <= most:
            raise ValueError(f"must be a number from {least:g} to {most:g}")
        return float(value)

    return read


def _domain(value: object) -> int:
    if type(value) is not int or not 0 <= value <= _LAST_DOMAIN:
        raise ValueError(f"must be a whole number from 0 to {_LAST_DOMAIN}")
    return value


def _text(value: object) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= _LONGEST:
        raise ValueError(f"must be a text of 1 to {_LONGEST} characters")
    return value


def _maybe_text(value: object) -> str:
    return "" if value == "" else _text(value)


def _topic(value: object) -> str:
    if value == "":
        return ""
    try:
        names.full_name(_text(value))
    except UnreadableError as error:
        raise ValueError(f"{error.detail}") from error
    return str(value)


def _frame(value: object) -> str:
    if _FRAME.fullmatch(_text(value)) is None:
        raise ValueError("must name a frame")
    return str(value).lstrip("/")


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise ValueError("must be true or false")
    return value


def _peers(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > _MOST_PEERS:
        raise ValueError(f"must be a list of at most {_MOST_PEERS} addresses")
    return tuple(_text(one) for one in value)


def _quality(value: object) -> dict[str, object]:
    kinds: dict[str, type] = {"reliable": bool, "transient_local": bool, "depth": int}
    if not isinstance(value, dict) or not value.keys() <= kinds.keys():
        raise ValueError(f"must be a table of {', '.join(kinds)}")
    for key, one in value.items():
        if type(one) is not kinds[key]:
            raise ValueError(f"{key} must be a {kinds[key].__name__}")
    if not 1 <= value.get("depth", 1) <= 1000:
        raise ValueError("depth must be from 1 to 1000")
    return dict(value)


_KEYS: dict[str, dict[str, _Reader]] = {
    "ros": {
        "domain": _domain,
        "namespace": _topic,
        "interface": _maybe_text,
        "peers": _peers,
    },
    "topics": dict.fromkeys(TOPICS, _topic),
    "frames": {one.name: _frame for one in fields(Frames)},
    "drive": {
        "stamped_in": _flag,
        "stamped_out": _flag,
        "max_speed": _number(0.05, 5.0),
        "max_turn": _number(0.05, 5.0),
    },
    "transforms": {"max_age_s": _number(0.05, 5.0)},
    "detector": {"classes": _maybe_text, "p_min": _number(0.0, 1.0)},
    "qos": dict.fromkeys(TOPICS, _quality),
}
"""Tables of the file, with their keys."""

# --- the file -----------------------------------------------------------------------


def read_config(text: str, file: str) -> RobotConfig:
    """Read ``robot.toml``; ``file`` is its name in error messages.

    Raises:
        DataFileError: naming line, key and reason.
    """
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line, _, why = syntax_error(error, text)
        raise DataFileError(file, f"line {line}", f"is not TOML: {why}.") from error
    page = _Page(file, text)
    tables = page.values((), raw, dict.fromkeys(_KEYS, _table))
    said = {
        name: page.values((name,), tables.get(name, {}), readers)
        for name, readers in _KEYS.items()
    }
    return RobotConfig(
        **said["ros"],
        topics=_NAMES | said["topics"],
        frames=Frames(**said["frames"]),
        drive=DriveConfig(**said["drive"]),
        tf_max_age_s=said["transforms"].get("max_age_s", 0.5),
        class_list=said["detector"].get("classes", ""),
        p_min=said["detector"].get("p_min", 0.8),
        qualities={
            topic: replace(usual, **said["qos"].get(topic, {}))
            for topic, usual in _QUALITIES.items()
        },
    )


@dataclass(frozen=True, slots=True)
class _Page:
    """Text of the file, to find the line of an error."""

    file: str
    text: str

    def values(
        self,
        path: tuple[str, ...],
        table: Mapping[str, object],
        readers: Mapping[str, _Reader],
    ) -> dict[str, Any]:
        """Values of the table at ``path``, each by the reader of its key."""
        found = {}
        for key, value in table.items():
            if key not in readers:
                reason = f"is unknown; known are {', '.join(readers)}"
                raise self._refusal((*path, key), reason)
            try:
                found[key] = readers[key](value)
            except ValueError as error:
                raise self._refusal((*path, key), str(error)) from error
        return found

    def _refusal(self, path: tuple[str, ...], reason: str) -> DataFileError:
        line, _ = place_of(self.text, path)
        where = f"line {line}, {'.'.join(path)}"
        return DataFileError(self.file, where, f"{reason}.")


def read_classes(text: str) -> tuple[str, ...]:
    """A detector's class names, one per line, in the order of their numbers."""
    return tuple(line.strip() for line in text.splitlines() if line.strip())
