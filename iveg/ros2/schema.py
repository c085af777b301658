"""Schema of ROS messages: Python types annotated with IDL types.

A message is a frozen dataclass whose annotations define the wire format::

    stamp: Time                                    a structure
    frame_id: str                                  a string
    score: Float64                                 a primitive
    covariance: Covariance                         a fixed array of primitives
    ranges: Annotated[Floats, Many("float32")]     a sequence of primitives
    poses: tuple[PoseStamped, ...]                 a sequence of structures

``cdr`` makes codecs from them, ``adapters/dds_types`` the types that DDS announces.
"""

from abc import ABC
from dataclasses import dataclass, fields
from functools import cache
from typing import (
    Annotated,
    Any,
    ClassVar,
    get_args,
    get_origin,
    get_type_hints,
)

PRIMITIVES: dict[str, tuple[str, int]] = {
    "boolean": ("?", 1),
    "uint8": ("B", 1),
    "int8": ("b", 1),
    "uint16": ("H", 2),
    "int16": ("h", 2),
    "uint32": ("I", 4),
    "int32": ("i", 4),
    "float32": ("f", 4),
    "float64": ("d", 8),
}
"""IDL name → code of ``struct`` and size, which is its alignment too (bytes)."""


class Message(ABC):
    """A ROS message: base of frozen dataclasses with ROS's names and fields.

    Args:
        package: ROS package of the message.

    Attributes:
        ROS: Its ROS name, such as ``nav_msgs/msg/Odometry``.
    """

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, Any]]
    ROS: ClassVar[str]

    def __init_subclass__(cls, package: str | None = None) -> None:
        # A dataclass with slots is made a second time, then without the package.
        if package is not None:
            cls.ROS = f"{package}/msg/{cls.__name__}"


@dataclass(frozen=True, slots=True)
class One:
    """A primitive of this IDL name."""

    primitive: str


@dataclass(frozen=True, slots=True)
class Many:
    """Primitives of this IDL name: ``count`` of them, or a sequence (None)."""

    primitive: str
    count: int | None = None


@dataclass(frozen=True, slots=True)
class Text:
    """A string in UTF-8."""


@dataclass(frozen=True, slots=True)
class Structure:
    """A message within a message, or a sequence of them."""

    message: type[Message]
    many: bool = False


Kind = One | Many | Text | Structure

Boolean = Annotated[bool, One("boolean")]
Uint8 = Annotated[int, One("uint8")]
Uint16 = Annotated[int, One("uint16")]
Uint32 = Annotated[int, One("uint32")]
Int32 = Annotated[int, One("int32")]
Float32 = Annotated[float, One("float32")]
Float64 = Annotated[float, One("float64")]


@cache
def fields_of(message: type[Message]) -> tuple[tuple[str, Kind], ...]:
    """The fields of a message in the order of the wire."""
    hints = get_type_hints(message, include_extras=True)
    return tuple((field.name, _kind(hints[field.name])) for field in fields(message))


def _kind(hint: Any) -> Kind:
    if get_origin(hint) is Annotated:
        kind: Kind = get_args(hint)[1]
        return kind
    if hint is str:
        return Text()
    if get_origin(hint) is tuple:
        return Structure(get_args(hint)[0], many=True)
    return Structure(hint)
