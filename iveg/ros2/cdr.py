"""Plain CDR, version 1: the bytes of a ROS 2 message, both byte orders.

Source: OMG Common Data Representation (CORBA 3.3, 9.3) and its RTPS encapsulation
(DDSI-RTPS 2.5, 10.2).  A primitive of n bytes begins at a multiple of n, counted from
the end of the four bytes of encapsulation; a string has its length (with the zero at
its end) before it, a sequence its count.  XCDR2 and parameter lists are left out: ROS 2
sends neither.

A message type has one list of steps, each of which reads and writes; primitives that
follow each other are one step, with one ``struct`` prepared for each of the eight ways
in which they can lie.
"""

import itertools
import operator
import struct
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Any, TypeVar

import numpy as np

from iveg.domain.errors import UnreadableError
from iveg.ros2.cdr_bytes import HEADS, ByteOrder, ByteReader, ByteWriter
from iveg.ros2.schema import (
    PRIMITIVES,
    Kind,
    Many,
    Message,
    One,
    Structure,
    fields_of,
)

_ORDERS: dict[bytes, ByteOrder] = {b"\x00\x00": ">", b"\x00\x01": "<"}

_M = TypeVar("_M", bound=Message)


def read(message: type[_M], payload: bytes) -> _M:
    """Read one message; bytes after it are padding and ignored.

    Args:
        message: Its type.
        payload: With its encapsulation.

    Raises:
        UnreadableError: bytes that this type does not describe.
    """
    order = _ORDERS.get(payload[:2])
    if order is None or len(payload) < 4:
        raise UnreadableError("bad_encapsulation", payload[:4].hex())
    try:
        found: _M = _codec_of(message).read(ByteReader(order, memoryview(payload)[4:]))
    except struct.error as error:
        raise UnreadableError("too_short", f"{len(payload)} bytes") from error
    except UnicodeDecodeError as error:
        raise UnreadableError("bad_text", error.reason) from error
    return found


def write(message: Message, order: ByteOrder = "<") -> bytes:
    """The bytes of one message, with its encapsulation."""
    out = ByteWriter(order)
    _codec_of(type(message)).write(out, message)
    return HEADS[order] + bytes(out.data)


# --- the bytes ---------------------------------------------------------------------


# --- a message ---------------------------------------------------------------------


class _Codec:
    """One type of message: its steps, and how a message is made of their values."""

    def __init__(self, message: type[Message]) -> None:
        leaves = list(_leaves(message))
        self._steps = list(_steps(kind for _, kind in leaves))
        # With a name too many it gives a tuple of one leaf as well.
        self._values_of = operator.attrgetter(*(name for name, _ in leaves), "ROS")
        self._make = _maker(message)

    def read(self, source: ByteReader) -> Any:
        """The message at the reader's place."""
        found = (value for step in self._steps for value in step.read(source))
        return self._make(found)

    def write(self, out: ByteWriter, message: Message) -> None:
        """Write a message of this type."""
        values = iter(self._values_of(message))
        for step in self._steps:
            step.write(out, values)


_codec_of = cache(_Codec)


def _leaves(message: type[Message], within: str = "") -> Iterator[tuple[str, Kind]]:
    """Values in the order of the wire, by dotted name, structures dissolved."""
    for name, kind in fields_of(message):
        if isinstance(kind, Structure) and not kind.many:
            yield from _leaves(kind.message, f"{within}{name}.")
        else:
            yield within + name, kind


def _maker(message: type[Message]) -> Callable[[Iterator[object]], object]:
    """The function that makes a message of its values in the order of the wire."""
    parts = [
        _maker(kind.message) if isinstance(kind, Structure) and not kind.many else next
        for _, kind in fields_of(message)
    ]

    def make(values: Iterator[object]) -> object:
        return message(*[part(values) for part in parts])

    return make


def _steps(kinds: Iterable[Kind]) -> "Iterator[_Step]":
    """Steps over the values, as many primitives together as follow each other."""
    for is_one, group in itertools.groupby(kinds, lambda kind: isinstance(kind, One)):
        if is_one:
            yield _Run([one.primitive for one in group if isinstance(one, One)])
            continue
        for kind in group:
            match kind:
                case Many():
                    yield _Numbers(kind)
                case Structure():
                    yield _Messages(kind.message)
                case _:
                    yield _String()


# --- steps -------------------------------------------------------------------------


class _Run:
    """Primitives that follow each other in every message of a type."""

    def __init__(self, primitives: list[str]) -> None:
        self._length = len(primitives)
        self._layouts = {
            order: [struct.Struct(order + _layout(primitives, n)) for n in range(8)]
            for order in HEADS
        }

    def read(self, source: ByteReader) -> Iterable[object]:
        """The values, by one ``struct``."""
        prepared = self._layouts[source.order][source.at % 8]
        found = prepared.unpack_from(source.data, source.at)
        source.at += prepared.size
        return found

    def write(self, out: ByteWriter, values: Iterator[object]) -> None:
        """The inverse."""
        prepared = self._layouts[out.order][len(out.data) % 8]
        out.data += prepared.pack(*itertools.islice(values, self._length))


def _layout(primitives: Iterable[str], start: int) -> str:
    """Format of ``struct`` for a run that begins at ``start`` modulo eight."""
    at, words = start, ""
    for primitive in primitives:
        code, size = PRIMITIVES[primitive]
        gap = -at % size
        words += "x" * gap + code
        at += gap + size
    return words


class _String:
    """A text: its length with the zero at its end, and its bytes."""

    def read(self, source: ByteReader) -> Iterable[object]:
        """The text; some senders leave an empty one without its zero."""
        size = source.count()
        begin = source.pass_over(size)
        return (str(source.data[begin : max(begin, source.at - 1)], "utf-8"),)

    def write(self, out: ByteWriter, values: Iterator[object]) -> None:
        """The inverse."""
        raw = str(next(values)).encode() + b"\x00"
        out.count(len(raw))
        out.data += raw


class _Numbers:
    """Primitives of one kind, as a numpy array: a fixed count, or a sequence."""

    def __init__(self, kind: Many) -> None:
        self._fixed = kind.count
        code, self._size = PRIMITIVES[kind.primitive]
        self._types = {order: np.dtype(order + code) for order in HEADS}

    def read(self, source: ByteReader) -> Iterable[object]:
        """The array, in this machine's byte order."""
        count = source.count() if self._fixed is None else self._fixed
        if count:
            source.align(self._size)
        begin = source.pass_over(count * self._size)
        kind = self._types[source.order]
        found = np.frombuffer(source.data, kind, count, begin)
        return (found if kind.isnative else found.astype(kind.newbyteorder("=")),)

    def write(self, out: ByteWriter, values: Iterator[object]) -> None:
        """The inverse."""
        numbers = np.asarray(next(values), self._types[out.order])
        if self._fixed is None:
            out.count(numbers.size)
        elif numbers.size != self._fixed:
            raise ValueError(f"{numbers.size} numbers instead of {self._fixed}")
        if numbers.size:
            out.align(self._size)
        out.data += numbers.tobytes()


class _Messages:
    """A sequence of messages."""

    def __init__(self, message: type[Message]) -> None:
        self._codec = _codec_of(message)

    def read(self, source: ByteReader) -> Iterable[object]:
        """The messages; each has a byte at least."""
        count = source.count()
        if count > len(source.data) - source.at:
            raise UnreadableError("too_short", f"at byte {source.at}")
        return (tuple(self._codec.read(source) for _ in range(count)),)

    def write(self, out: ByteWriter, values: Iterator[Any]) -> None:
        """The inverse."""
        items = next(values)
        out.count(len(items))
        for item in items:
            self._codec.write(out, item)


_Step = _Run | _String | _Numbers | _Messages
"""The next one or more values of a message."""
