"""What a recording holds, and its way to the process that writes it.

An input is a head of fixed size, a name and a payload, so that the loop packs it in a
microsecond and nothing is read before it is in the other process.
"""

import re
import struct
from collections.abc import Iterator, Sequence
from enum import IntEnum
from typing import Final, NamedTuple

from iveg.adapters.recordings.mcap_file import Channel
from iveg.domain.observations import Instant, LaserScan, Observation, Overtaken

NOTIFICATIONS = Channel("/ngsi/notifications", "ngsi.Notification")
PICTURES = Channel("/iveg/pictures", "iveg.Picture")
WHOLE_S: Final = 10.0
"""Between two whole pictures."""
WHOLE, CHANGED = b'{"whole":true,', b'{"whole":false,'
"""How a picture begins."""
_NUMBERS = re.compile(rb"\[[-+.,\deE\snul]{100,}\]")
"""A long list of numbers in JSON."""
_HEAD = struct.Struct("<BddHI")
"""Sort, both clocks (s), bytes of the name and of the payload."""


class Sort(IntEnum):
    """What came in; what its name says."""

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
    encoded = name.encode()
    head = _HEAD.pack(sort, at.mono, at.wall, len(encoded), len(payload))
    return b"".join((head, encoded, payload))


def worth_keeping(body: bytes, observed: Sequence[Observation]) -> bytes:
    """A notification without numbers that are kept already.

    Of a scan that its twin has overtaken nothing but its identity was read, and nothing
    else is recorded: its numbers are those of its twin.
    """
    are_twins = bool(observed) and all(
        isinstance(one, Overtaken) and one.kind is LaserScan for one in observed
    )
    return _NUMBERS.sub(b"[]", body) if are_twins else body


class Unpacking:
    """Inputs from a stream of bytes, in whichever pieces they come."""

    def __init__(self) -> None:
        self._left = b""

    def feed(self, piece: bytes) -> Iterator[Incoming]:
        """The inputs that are whole by now; to be used up before the next piece."""
        whole = self._left + piece if self._left else piece
        begins = 0
        while (found := _unpack(whole, begins)) is not None:
            one, begins = found
            yield one
        self._left = whole[begins:]


def _unpack(whole: bytes, begins: int) -> tuple[Incoming, int] | None:
    """The input that begins here, and where the next does; None: not all is there."""
    named = begins + _HEAD.size
    if named > len(whole):
        return None
    sort, mono, wall, name_size, size = _HEAD.unpack_from(whole, begins)
    payload_at = named + name_size
    ends = payload_at + size
    if ends > len(whole):
        return None
    name = whole[named:payload_at].decode()
    at = Instant(mono, wall)
    return Incoming(Sort(sort), at, name, whole[payload_at:ends]), ends
