"""Plain CDR, version 1: the bytes of a ROS 2 message, both byte orders.

Source: OMG Common Data Representation (CORBA 3.3, 9.3) and its RTPS encapsulation
(DDSI-RTPS 2.5, 10.2).  A primitive of n bytes begins at a multiple of n, counted from
the end of the four bytes of encapsulation; a string has its length (with the zero at
its end) before it, a sequence its count.  XCDR2 and parameter lists are left out: ROS 2
sends neither.

Primitives that follow each other in every message of a type are read by one ``struct``
call, prepared for each of the eight ways in which they can lie.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from itertools import count
from typing import Any, Literal, Protocol, TypeVar, cast

import numpy as np

from iveg.domain.errors import UnreadableError
from iveg.ros2.schema import (
    PRIMITIVES,
    Many,
    Message,
    One,
    Structure,
    Text,
    fields_of,
)

ByteOrder = Literal["<", ">"]
_ORDERS: dict[bytes, ByteOrder] = {b"\x00\x00": ">", b"\x00\x01": "<"}
_HEADS: dict[ByteOrder, bytes] = {">": b"\x00\x00\x00\x00", "<": b"\x00\x01\x00\x00"}
_COUNT: dict[ByteOrder, struct.Struct] = {
    order: struct.Struct(order + "I") for order in _HEADS
}

_M = TypeVar("_M", bound=Message)


def read(message: type[_M], payload: bytes) -> _M:
    """Read one message; what follows it is padding and not looked at.

    Raises:
        UnreadableError: bytes that this type does not describe.
    """
    order = _ORDERS.get(payload[:2])
    if order is None or len(payload) < 4:
        raise UnreadableError("bad_encapsulation", payload[:4].hex())
    cursor = _Cursor(memoryview(payload)[4:], order)
    codec = _codec_of(message)
    codec.read(cursor)
    return cast("_M", codec.build(cursor.values))


def write(message: Message, order: ByteOrder = "<") -> bytes:
    """The bytes of one message, with its encapsulation."""
    values: list[Any] = []
    codec = _codec_of(type(message))
    codec.flatten(message, values)
    out = _Out(order)
    codec.write(out, iter(values))
    return _HEADS[order] + bytes(out.data)


@cache
def _codec_of(message: type[Message]) -> "_Codec":
    return _Codec(message)


# --- a message ---------------------------------------------------------------------


class _Codec:
    """Steps over the wire, and how a message comes apart into values and together."""

    def __init__(self, message: type[Message]) -> None:
        self._message = message
        self._fields = [(name, _nested(kind)) for name, kind in fields_of(message)]
        self._steps = _merged(self.leaves())
        names: dict[str, Any] = {}
        words = self._words(names, count())
        # As dataclasses makes __init__: one expression is twice as fast as a recursion.
        self.build: Callable[[list[Any]], Any] = eval(f"lambda v: {words}", names)  # noqa: S307
        """The message of its values."""

    def _words(self, names: dict[str, Any], at: "count[int]") -> str:
        """What makes a message: ``m1(m0(v[0], v[1]), v[2])``."""
        parts = [
            f"v[{next(at)}]" if nested is None else nested._words(names, at)
            for _, nested in self._fields
        ]
        name = f"m{len(names)}"
        names[name] = self._message
        return f"{name}({', '.join(parts)})"

    def leaves(self) -> Iterator["One | _Step"]:
        """What lies on the wire in order, structures dissolved."""
        for (_, nested), (_, kind) in zip(
            self._fields, fields_of(self._message), strict=True
        ):
            if nested is not None:
                yield from nested.leaves()
            else:
                yield kind if isinstance(kind, One) else _step(kind)

    def read(self, cursor: "_Cursor") -> None:
        """Append this message's values to those of the cursor."""
        for step in self._steps:
            step.read(cursor)

    def write(self, out: "_Out", values: Iterator[Any]) -> None:
        """Write as many values as this message has."""
        for step in self._steps:
            step.write(out, values)

    def flatten(self, message: Any, values: list[Any]) -> None:
        """The values of this message, in order."""
        for name, nested in self._fields:
            value = getattr(message, name)
            if nested is None:
                values.append(value)
            else:
                nested.flatten(value, values)


def _nested(kind: object) -> _Codec | None:
    if isinstance(kind, Structure) and not kind.many:
        return _codec_of(kind.message)
    return None


# --- steps over the wire -----------------------------------------------------------


class _Step(Protocol):
    def read(self, cursor: "_Cursor") -> None: ...
    def write(self, out: "_Out", values: Iterator[Any]) -> None: ...


@dataclass(slots=True)
class _Cursor:
    """Where reading stands, and what was read."""

    data: memoryview
    order: ByteOrder
    at: int = 0
    values: list[Any] = field(default_factory=list)

    def numbers(self, layout: struct.Struct) -> tuple[Any, ...]:
        """Numbers at this place."""
        try:
            numbers = layout.unpack_from(self.data, self.at)
        except struct.error as error:
            raise UnreadableError("too_short", f"at byte {self.at}") from error
        self.at += layout.size
        return numbers

    def count(self) -> int:
        """A length or count."""
        self.at += -self.at % 4
        (count,) = self.numbers(_COUNT[self.order])
        return int(count)

    def take(self, size: int) -> memoryview:
        """Bytes at this place."""
        taken = self.data[self.at : self.at + size]
        if len(taken) < size:
            raise UnreadableError("too_short", f"at byte {self.at}")
        self.at += size
        return taken


@dataclass(slots=True)
class _Out:
    """What has been written."""

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
        self._layouts = {
            order: [struct.Struct(order + _layout(primitives, n)) for n in range(8)]
            for order in _HEADS
        }

    def read(self, cursor: _Cursor) -> None:
        cursor.values += cursor.numbers(self._layouts[cursor.order][cursor.at % 8])

    def write(self, out: _Out, values: Iterator[Any]) -> None:
        numbers = [next(values) for _ in range(self._size)]
        layout = self._layouts[out.order][len(out.data) % 8]
        out.data += layout.pack(*numbers)


def _layout(primitives: list[str], start: int) -> str:
    """``struct``'s words for primitives that begin at ``start`` modulo eight."""
    at, layout = start, ""
    for primitive in primitives:
        code, size = PRIMITIVES[primitive]
        gap = -at % size
        layout += "x" * gap + code
        at += gap + size
    return layout


class _String:
    def read(self, cursor: _Cursor) -> None:
        raw = cursor.take(cursor.count())
        try:
            # One byte is the zero at its end; some senders leave an empty text without.
            cursor.values.append(str(raw[:-1], "utf-8"))
        except UnicodeDecodeError as error:
            raise UnreadableError("bad_text", f"at byte {cursor.at}") from error

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
        self._native = self._types["<"].newbyteorder("=")

    def read(self, cursor: _Cursor) -> None:
        count = cursor.count() if self._count is None else self._count
        if count:
            cursor.at += -cursor.at % self._size
        raw = cursor.take(count * self._size)
        numbers = np.frombuffer(raw, self._types[cursor.order])
        cursor.values.append(numbers.astype(self._native, copy=False))

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

    def read(self, cursor: _Cursor) -> None:
        count = cursor.count()
        if count > len(cursor.data) - cursor.at:
            raise UnreadableError("too_short", f"{count} items at byte {cursor.at}")
        outer, found = cursor.values, []
        for _ in range(count):
            cursor.values = []
            self._codec.read(cursor)
            found.append(self._codec.build(cursor.values))
        cursor.values = outer
        outer.append(tuple(found))

    def write(self, out: _Out, values: Iterator[Any]) -> None:
        items = next(values)
        out.count(len(items))
        for item in items:
            flat: list[Any] = []
            self._codec.flatten(item, flat)
            self._codec.write(out, iter(flat))


def _step(kind: Many | Text | Structure) -> _Step:
    match kind:
        case Many():
            return _Numbers(kind)
        case Text():
            return _String()
        case Structure():
            return _Messages(kind)


def _merged(leaves: Iterator[One | _Step]) -> list[_Step]:
    steps: list[_Step] = []
    run: list[str] = []
    for leaf in leaves:
        if isinstance(leaf, One):
            run.append(leaf.primitive)
            continue
        if run:
            steps.append(_Run(run))
            run = []
        steps.append(leaf)
    if run:
        steps.append(_Run(run))
    return steps
