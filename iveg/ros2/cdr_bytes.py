"""Bytes of CDR, read and written in order, aligned to their size."""

import struct
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.errors import UnreadableError

ByteOrder = Literal["<", ">"]


HEADS: dict[ByteOrder, bytes] = {">": b"\x00\x00\x00\x00", "<": b"\x00\x01\x00\x00"}


_COUNT: dict[ByteOrder, struct.Struct] = {
    order: struct.Struct(order + "I") for order in HEADS
}


@dataclass(slots=True)
class ByteReader:
    """Bytes that are read, from ``at`` on."""

    order: ByteOrder
    data: memoryview
    at: int = 0

    def align(self, size: int) -> None:
        """Go on at the next multiple of ``size``."""
        self.at += -self.at % size

    def count(self) -> int:
        """A length or count."""
        self.align(4)
        (count,) = _COUNT[self.order].unpack_from(self.data, self.at)
        self.at += 4
        return int(count)

    def pass_over(self, size: int) -> int:
        """Where the next ``size`` bytes begin; the reader stands behind them.

        Raises:
            UnreadableError: there are fewer.
        """
        begin, self.at = self.at, self.at + size
        if self.at > len(self.data):
            raise UnreadableError("too_short", f"at byte {begin}")
        return begin


@dataclass(slots=True)
class ByteWriter:
    """Bytes that are written."""

    order: ByteOrder
    data: bytearray = field(default_factory=bytearray)

    def align(self, size: int) -> None:
        """Zeros up to the next multiple of ``size``."""
        self.data += bytes(-len(self.data) % size)

    def count(self, count: int) -> None:
        """A length or count."""
        self.align(4)
        self.data += _COUNT[self.order].pack(count)
