"""Plain CDR, version 1: the bytes of a ROS 2 message, both byte orders.

Source: OMG Common Data Representation (CORBA 3.3, 9.3) and its RTPS encapsulation
(DDSI-RTPS 2.5, 10.2).  A primitive of n bytes begins at a multiple of n, counted from
the end of the four bytes of encapsulation; a string has its length (with the zero at
its end) before it, a sequence its count.  XCDR2 and parameter lists are left out: ROS 2
sends neither.

Primitives that follow each other in every message of a type are written by one
``struct`` call, prepared for each of the eight ways in which they can lie; ``decoder``
reads them so.
"""

import itertools
import operator
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Protocol, TypeVar

import numpy as np

from iveg.domain.errors import UnreadableError
from iveg.ros2.decoder import ByteOrder, Fields, decoder_of, layout
from iveg.ros2.schema import (
    PRIMITIVES,
    Kind,
    Many,
    Message,
    One,
    Structure,
    Text,
    fields_of,
)

_ORDERS: dict[bytes, ByteOrder] = {b"\x00\x00": ">", b"\x00\x01": "<"}
_HEADS: dict[ByteOrder, bytes] = {">": b"\x00\x00\x00\x00", "<": b"\x00\x01\x00\x00"}
_COUNT: dict[ByteOrder, struct.Struct] = {
    order: struct.Struct(order + "I") for order in _HEADS
}
_ALL: Fields = frozenset()

_M = TypeVar("_M", bound=Message)


def read(message: type[_M], payload: bytes, left_out: Fields = _ALL) -> _M:
    """Read one message; bytes after it are padding and ignored.

    Args:
        message: Its type.
        payload: With its encapsulation.
        left_out: Unused fields; they keep their default.

    Raises:
        UnreadableError: bytes that this type does not describe.
    """
    order = _ORDERS.get(payload[:2])
    if order is None or len(payload) < 4:
        raise UnreadableError("bad_encapsulation", payload[:4].hex())
    try:
        decoded: _M = decoder_of(message, order, left_out)(memoryview(payload)[4:])
    except struct.error as error:
        raise UnreadableError("too_short", f"{len(payload)} bytes") from error
    except UnicodeDecodeError as error:
        raise UnreadableError("bad_text", error.reason) from error
    return decoded


def write(message: Message, order: ByteOrder = "<") -> bytes:
    """The bytes of one message, with its encapsulation."""
    out = _Out(order)
    _codec_of(type(message)).write(out, message)
    return _HEADS[order] + bytes(out.data)


@cache
def _codec_of(message: type[Message]) -> "_Codec":
    return _Codec(message)


# --- a message ---------------------------------------------------------------------


class _Codec:
    """Encoding steps of a message, and its decomposition into values."""

    def __init__(self, message: type[Message]) -> None:
        leaves = list(_leaves(message))
        self._steps = _merged(kind for _, kind in leaves)
        # With a name too many it gives a tuple of one leaf as well.
        self._values = operator.attrgetter(*(name for name, _ in leaves), "ROS")

    def write(self, out: "_Out", message: Message) -> None:
        """Write its values in order."""
        values = iter(self._values(message))
        for step in self._steps:
            step.write(out, values)


def _leaves(message: type[Message], within: str = "") -> Iterator[tuple[str, Kind]]:
    """Values in the order of the wire, by dotted name, structures dissolved."""
    for name, kind in fields_of(message):
        if isinstance(kind, Structure) and not kind.many:
            yield from _leaves(kind.message, f"{within}{name}.")
        else:
            yield within + name, kind


# --- steps over the wire -----------------------------------------------------------


class _Step(Protocol):
    def write(self, out: "_Out", values: Iterator[Any]) -> None: ...


@dataclass(slots=True)
class _Out:
    """Output buffer."""

    order: ByteOrder
    data: bytearray = field(default_factory=bytearray)

    def align(self, size: int) -> None:
        """Zeros up to the next multiple of ``size``."""
        self.data += bytes(-len(self.data) % size)

    def count(self, count: int) -> None:
        """A length or count."""
        self.align(4)
        self.data += _COUNT[self.order].pack(count)


class _Run:
    """Primitives that follow each other in every message of a type."""

    def __init__(self, primitives: list[str]) -> None:
        self._size = len(primitives)
        run = [(*PRIMITIVES[one], 1) for one in primitives]
        self._layouts = {
            order: [struct.Struct(order + layout(run, n)) for n in range(8)]
            for order in _HEADS
        }

    def write(self, out: _Out, values: Iterator[Any]) -> None:
        prepared = self._layouts[out.order][len(out.data) % 8]
        out.data += prepared.pack(*itertools.islice(values, self._size))


class _String:
    def write(self, out: _Out, values: Iterator[Any]) -> None:
        raw = str(next(values)).encode() + b"\x00"
        out.count(len(raw))
        out.data += raw


class _Numbers:
    """Primitives of one kind, as a numpy array: ``count`` of them, or a sequence."""

    def __init__(self, kind: Many) -> None:
        code, self._size = PRIMITIVES[kind.primitive]
        self._count = kind.count
        self._types = {order: np.dtype(order + code) for order in _HEADS}

    def write(self, out: _Out, values: Iterator[Any]) -> None:
        numbers = np.asarray(next(values), self._types[out.order])
        if self._count is None:
            out.count(numbers.size)
        elif numbers.size != self._count:
            raise ValueError(f"{numbers.size} numbers instead of {self._count}")
        if numbers.size:
            out.align(self._size)
        out.data += numbers.tobytes()


class _Messages:
    """A sequence of structures."""

    def __init__(self, kind: Structure) -> None:
        self._codec = _codec_of(kind.message)

    def write(self, out: _Out, values: Iterator[Any]) -> None:
        items = next(values)
        out.count(len(items))
        for item in items:
            self._codec.write(out, item)


def _step(kind: Many | Text | Structure) -> _Step:
    match kind:
        case Many():
            return _Numbers(kind)
        case Text():
            return _String()
        case Structure():
            return _Messages(kind)


def _merged(kinds: Iterable[Kind]) -> list[_Step]:
    steps: list[_Step] = []
    run: list[str] = []
    for kind in kinds:
        if isinstance(kind, One):
            run.append(kind.primitive)
            continue
        if run:
            steps.append(_Run(run))
            run = []
        steps.append(_step(kind))
    if run:
        steps.append(_Run(run))
    return steps
