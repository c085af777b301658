"""A reader for one message type, generated as Python source and compiled once.

As ``dataclasses`` makes ``__init__``: a robot reads some hundred messages a second, and
straight lines cost a third of what steps do that call each other.  Primitives that
follow each other, the length of a text or sequence behind them included, are read by
one ``struct`` call, prepared for each of the eight ways in which they can lie.

A message is created as a draft, a mutable class with the same slots, whose class is
then
changed: the ``__init__`` of a frozen class takes five times as long.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, NoReturn

import numpy as np

from iveg.domain.errors import UnreadableError
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

ByteOrder = Literal["<", ">"]
Fields = frozenset[tuple[type[Message], str]]
"""Fields of messages, by the message that has them."""
Decoder = Callable[[memoryview], Any]


@cache
def decoder_of(message: type[Message], order: ByteOrder, left_out: Fields) -> Decoder:
    """The function that reads a message after its encapsulation.

    Args:
        message: Its type.
        order: Of its bytes.
        left_out: Fields that keep their default; each of a size that never varies.

    It raises ``UnreadableError``, ``struct.error`` or ``UnicodeDecodeError`` for bytes
    that this type does not describe.
    """
    source = _Source(order, left_out)
    parts = source.message(message)
    return source.compiled(source.made(parts))


@cache
def _draft_of(message: type[Message]) -> type:
    slots = tuple(name for name, _ in fields_of(message))
    return type(f"{message.__name__}Draft", (Message,), {"__slots__": slots})


def layout(run: list[tuple[str, int, int]], start: int) -> str:
    """Format of ``struct`` for a run that begins at ``start`` modulo eight.

    Args:
        run: Code, size of one (bytes) and how many; ``x``: so many that are not read.
        start: Counted from the end of the encapsulation.
    """
    at, words = start, ""
    for code, size, count in run:
        gap = -at % size
        words += "x" * gap + (f"{count * size}x" if code == "x" else code)
        at += gap + count * size
    return words


def _too_short(at: int) -> NoReturn:
    raise UnreadableError("too_short", f"at byte {at}")


@dataclass(frozen=True, slots=True)
class _Parts:
    """A message that was read: the name of each field, or its parts."""

    message: type[Message]
    said: "dict[str, str | _Parts]"


class _Source:
    """Source lines of a reader: ``d`` has ``z`` bytes, ``at`` is the position."""

    def __init__(self, order: ByteOrder, left_out: Fields) -> None:
        self._order, self._left_out = order, left_out
        self._lines: list[str] = []
        self._indent = " "
        self._names: dict[str, Any] = {
            "too_short": _too_short,
            "frombuffer": np.frombuffer,
        }
        self._run: list[tuple[str, int, int]] = []
        self._read: list[str] = []

    def compiled(self, made: str) -> Decoder:
        """Compile the function that returns the named value."""
        head = ["def decode(d):", " at, z = 0, len(d)"]
        exec("\n".join([*head, *self._lines, f" return {made}"]), self._names)  # noqa: S102
        decode: Decoder = self._names["decode"]
        return decode

    def message(self, message: type[Message]) -> "_Parts":
        """Read a message; returns the expressions of its parts."""
        return _Parts(
            message,
            {
                name: self._skipped(message, name, kind)
                if (message, name) in self._left_out
                else self._value(kind)
                for name, kind in fields_of(message)
            },
        )

    def made(self, parts: "_Parts") -> str:
        """Create a message from its parts; returns its name."""
        self._flush()
        return self._make(parts)

    def _make(self, parts: "_Parts") -> str:
        said = {
            field: self._make(part) if isinstance(part, _Parts) else part
            for field, part in parts.said.items()
        }
        made = self._fresh()
        self._line(f"{made} = {self._named(_draft_of(parts.message))}()")
        for field, part in said.items():
            self._line(f"{made}.{field} = {part}")
        self._line(f"{made}.__class__ = {self._named(parts.message)}")
        return made

    def _flush(self) -> None:
        """Read the collected run."""
        if not self._run:
            return
        layouts = [struct.Struct(self._order + layout(self._run, n)) for n in range(8)]
        table = self._named([(one.unpack_from, one.size) for one in layouts])
        self._line(f"unpack, size = {table}[at & 7]")
        into = f"{', '.join(self._read)}, = " if self._read else ""
        self._line(f"{into}unpack(d, at)")
        self._line("at += size")
        self._run, self._read = [], []

    # --- values -------------------------------------------------------------------

    def _value(self, kind: Kind) -> "str | _Parts":
        match kind:
            case One(primitive):
                return self._one(primitive)
            case Text():
                return self._text()
            case Many(primitive, count):
                return self._many(primitive, count)
            case Structure(message, many=True):
                return self._messages(message)
            case Structure(message):
                return self.message(message)

    def _one(self, primitive: str) -> str:
        self._run.append((*PRIMITIVES[primitive], 1))
        self._read.append(self._fresh())
        return self._read[-1]

    def _count(self) -> str:
        count = self._one("uint32")
        self._flush()
        return count

    def _text(self) -> str:
        size, text = self._count(), self._fresh()
        # One byte is the zero at its end; some senders leave an empty text without.
        self._until(f"at + {size}", f"{text} = str(d[at : end - 1], 'utf-8')")
        return text

    def _many(self, primitive: str, fixed: int | None) -> str:
        code, size = PRIMITIVES[primitive]
        self._flush()
        count = self._count() if fixed is None else str(fixed)
        kind = np.dtype(self._order + code)
        turned = f".astype({self._named(kind.newbyteorder('='))})"
        many = self._fresh()
        self._line(f"at += -at & {size - 1} if {count} else 0")
        self._until(
            f"at + {count} * {size}",
            f"{many} = frombuffer(d, {self._named(kind)}, {count}, at)"
            f"{'' if kind.isnative else turned}",
        )
        return many

    def _messages(self, message: type[Message]) -> str:
        count, many = self._count(), self._fresh()
        self._line(f"if {count} > z - at: too_short(at)")
        self._line(f"{many} = []")
        self._line(f"for _ in range({count}):")
        self._indent += " "
        made = self.made(self.message(message))
        self._line(f"{many}.append({made})")
        self._indent = self._indent[:-1]
        self._line(f"{many} = tuple({many})")
        return many

    def _skipped(self, message: type[Message], name: str, kind: Kind) -> str:
        self._skip(kind)
        return self._named(getattr(message(), name))

    def _skip(self, kind: Kind) -> None:
        match kind:
            case One(primitive):
                self._run.append(("x", PRIMITIVES[primitive][1], 1))
            case Many(primitive, int(count)):
                self._run.append(("x", PRIMITIVES[primitive][1], count))
            case Structure(message, many=False):
                for _, part in fields_of(message):
                    self._skip(part)
            case _:
                raise ValueError(f"{kind} has no size of its own")

    # --- lines --------------------------------------------------------------------

    def _until(self, end: str, line: str) -> None:
        """Read up to ``end``, if there are enough bytes."""
        self._line(f"end = {end}")
        self._line("if end > z: too_short(at)")
        self._line(line)
        self._line("at = end")

    def _line(self, line: str) -> None:
        self._lines.append(self._indent + line)

    def _fresh(self) -> str:
        name = f"v{len(self._names)}"
        self._names[name] = None
        return name

    def _named(self, thing: object) -> str:
        name = f"k{len(self._names)}"
        self._names[name] = thing
        return name
