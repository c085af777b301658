"""Inputs of a recording, and their way to the process that writes them.

An input is a line of JSON and a payload, so that the loop packs it in a microsecond and
nothing is read before it is in the other process.
"""

from collections.abc import Iterator
from enum import IntEnum
from typing import BinaryIO, Final, NamedTuple

import orjson

from iveg.adapters.recordings.mcap_file import Channel
from iveg.domain.observations import Instant

NOTIFICATIONS = Channel("/ngsi/notifications", "ngsi.Notification")
PICTURES = Channel("/iveg/pictures", "iveg.Picture")
WHOLE_S: Final = 10.0
"""Between two whole pictures."""
WHOLE, CHANGED = b'{"whole":true,', b'{"whole":false,'
"""How a picture begins."""


class Sort(IntEnum):
    """Sort of an input, which says what its name is."""

    MEASURE = 1
    """A message of MQTT: its topic."""
    NOTIFICATION = 2
    ROW = 3
    """A row of the history or a version of the rule: the name of its schema."""
    PICTURE = 4
    """What pages are sent, or what of that has changed since the picture before."""


class Incoming(NamedTuple):
    """One input."""

    sort: Sort
    at: Instant
    name: str
    payload: bytes

    @property
    def channel(self) -> Channel:
        """The channel that it is recorded on."""
        match self.sort:
            case Sort.MEASURE:
                return Channel(self.name, "iveg.Measure")
            case Sort.NOTIFICATION:
                return NOTIFICATIONS
            case Sort.ROW:
                return Channel(f"/iveg/{self.name.lower()}", f"iveg.{self.name}")
        return PICTURES


def pack(sort: Sort, at: Instant, name: str = "", payload: bytes = b"") -> bytes:
    """An input as bytes."""
    head = orjson.dumps([sort, at.mono, at.wall, name, len(payload)])
    return b"".join((head, b"\n", payload))


def unpack(stream: BinaryIO) -> Iterator[Incoming]:
    """Inputs of a stream until it ends; one that is cut short is left out."""
    while (head := stream.readline()).endswith(b"\n"):
        sort, mono, wall, name, size = orjson.loads(head)
        payload = stream.read(size)
        if len(payload) == size:
            yield Incoming(Sort(sort), Instant(mono, wall), name, payload)
