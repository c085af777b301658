"""Messages of ``builtin_interfaces`` and ``std_msgs``: times, headers and colours."""

import math
from dataclasses import dataclass

from iveg.ros2.schema import Float32, Int32, Message, Uint32


@dataclass(frozen=True, slots=True)
class Time(Message, package="builtin_interfaces"):
    """Seconds and nanoseconds since 1970."""

    sec: Int32 = 0
    nanosec: Uint32 = 0

    @classmethod
    def of(cls, seconds: float) -> "Time":
        """The stamp of a Unix time (s)."""
        whole = math.floor(seconds)
        return cls(whole, min(999_999_999, round((seconds - whole) * 1e9)))

    @property
    def seconds(self) -> float:
        """Unix time (s)."""
        return self.sec + self.nanosec / 1e9


@dataclass(frozen=True, slots=True)
class Duration(Message, package="builtin_interfaces"):
    """A duration (s, ns)."""

    sec: Int32 = 0
    nanosec: Uint32 = 0


@dataclass(frozen=True, slots=True)
class Header(Message, package="std_msgs"):
    """Time of measurement, and frame."""

    stamp: Time = Time()
    frame_id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Stamped(Message):
    """What messages with a header have in common: it is their first field."""

    header: Header = Header()


@dataclass(frozen=True, slots=True)
class ColorRGBA(Message, package="std_msgs"):
    """Each 0 to 1."""

    r: Float32 = 0.0
    g: Float32 = 0.0
    b: Float32 = 0.0
    a: Float32 = 1.0
