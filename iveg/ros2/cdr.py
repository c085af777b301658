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
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any, TypeVar

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
    _writer_of(type(message))(out, message)
    return _HEADS[order] + bytes(out.data)


# --- a message ---------------------------------------------------------------------


@cache
def _writer_of(message: type[Message]) -> "Callable[[_Out, Message], None]":
    """The function that writes a message of this type."""
    leaves = list(_leaves(message))
    steps = _merged(kind for _, kind in leaves)
    # With a name too many it gives a tuple of one leaf as well.
    values_of = operator.attrgetter(*(name for name, _ in leaves), "ROS")

    def write(out: _Out, message: Message) -> None:
        values = iter(values_of(message))
        for step in steps:
            step(out, values)

    return write


def _leaves(message: type[Message], within: str = "") -> Iterator[tuple[str, Kind]]:
    """Values in the order of the wire, by dotted name, structures dissolved."""
    for name, kind in fields_of(message):
        if isinstance(kind, Structure) and not kind.many:
            yield from _leaves(kind.message, f"{within}{name}.")
        else:
            yield within + name, kind


# --- steps over the wire -----------------------------------------------------------


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


_Step = Callable[[_Out, Iterator[Any]], None]
"""Writes the next one or more of the values."""


def _run(primitives: list[str]) -> _Step:
    """Primitives that follow each other in every message of a type."""
    run = [(*PRIMITIVES[one], 1) for one in primitives]
    layouts = {
        order: [struct.Struct(order + layout(run, n)) for n in range(8)]
        for order in _HEADS
    }

    def write(out: _Out, values: Iterator[Any]) -> None:
        prepared = layouts[out.order][len(out.data) % 8]
        out.data += prepared.pack(*itertools.islice(values, len(run)))

    return write


def _text(out: _Out, values: Iterator[Any]) -> None:
    raw = str(next(values)).encode() + b"\x00"
    out.count(len(raw))
    out.data += raw


def _numbers(kind: Many) -> _Step:
    """Primitives of one kind, as a numpy array: ``count`` of them, or a sequence."""
    code, size = PRIMITIVES[kind.primitive]
    types = {order: np.dtype(order + code) for order in _HEADS}

    def write(out: _Out, values: Iterator[Any]) -> None:
        numbers = np.asarray(next(values), types[out.order])
        if kind.count is None:
            out.count(numbers.size)
        elif numbers.size != kind.count:
            raise ValueError(f"{numbers.size} numbers instead of {kind.count}")
        if numbers.size:
            out.align(size)
        out.data += numbers.tobytes()

    return write


def _messages(kind: Structure) -> _Step:
    """A sequence of structures."""
    write_one = _writer_of(kind.message)

    def write(out: _Out, values: Iterator[Any]) -> None:
        items = next(values)
        out.count(len(items))
        for item in items:
            write_one(out, item)

    return write


def _step(kind: Many | Text | Structure) -> _Step:
    match kind:
        case Many():
            return _numbers(kind)
        case Text():
            return _text
        case Structure():
            return _messages(kind)


def _merged(kinds: Iterable[Kind]) -> list[_Step]:
    steps: list[_Step] = []
    run: list[str] = []
    for kind in kinds:
        if isinstance(kind, One):
            run.append(kind.primitive)
            continue
        if run:
            steps.append(_run(run))
            run = []
        steps.append(_step(kind))
    if run:
        steps.append(_run(run))
    return steps
