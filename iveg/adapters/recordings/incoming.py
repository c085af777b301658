"""What a recording holds: the messages that came in, and rows of the history."""

from collections.abc import Iterator
from dataclasses import dataclass

import orjson

from iveg.adapters.recordings import foxglove
from iveg.adapters.recordings.mcap_file import Channel
from iveg.domain.errors import UnreadableError
from iveg.domain.observations import Instant, Observation, Received, UnreadScan
from iveg.domain.records import Record

NOTIFICATIONS = Channel("/ngsi/notifications", "ngsi.Notification")
TICKS = Channel("/iveg/ticks", "iveg.Tick")
Message = tuple[Channel, bytes]


def measure(topic: str) -> Channel:
    """The channel of a robot's messages on a topic of MQTT."""
    return Channel(topic, "iveg.Measure")


@dataclass(frozen=True, slots=True)
class Raw:
    """A message of the outside, byte for byte."""

    channel: Channel
    at: Instant
    payload: bytes

    def messages(self) -> Iterator[Message]:
        """Itself."""
        yield self.channel, self.payload


@dataclass(frozen=True, slots=True)
class Drawn:
    """An observation, as viewers draw it."""

    received: Received

    @property
    def at(self) -> Instant:
        """When it came."""
        return self.received.at

    def messages(self) -> Iterator[Message]:
        """Foxglove's messages of it; none where it cannot be read."""
        try:
            observation = _read(self.received.observation)
        except UnreadableError:
            return
        for channel, value in foxglove.told(observation, self.at.wall):
            yield channel, orjson.dumps(value)


def _read(observation: Observation) -> Observation:
    """The observation itself; a scan that nobody has read yet is read now."""
    return observation.read() if isinstance(observation, UnreadScan) else observation


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the history, on a channel of its kind."""

    record: Record
    at: Instant

    def messages(self) -> Iterator[Message]:
        """The row as JSON."""
        name = type(self.record).__name__.removesuffix("Record")
        channel = Channel(f"/iveg/{name.lower()}", f"iveg.{name}")
        yield channel, orjson.dumps(self.record, option=orjson.OPT_SERIALIZE_NUMPY)


@dataclass(frozen=True, slots=True)
class Tick:
    """The loop let time pass; tells what the wall clock said then."""

    at: Instant

    def messages(self) -> Iterator[Message]:
        """Both clocks (s)."""
        yield TICKS, orjson.dumps({"wall": self.at.wall, "mono": self.at.mono})


Incoming = Raw | Drawn | Row | Tick
