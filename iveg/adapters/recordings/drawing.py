"""What viewers draw of the messages that came in, thinned."""

import contextlib
from collections.abc import Iterator, Sequence

import orjson

from iveg.adapters.direct import DirectReader
from iveg.adapters.recordings import foxglove
from iveg.adapters.recordings.incoming import Incoming, Sort
from iveg.adapters.recordings.mcap_file import Channel
from iveg.domain.errors import UnreadableError
from iveg.domain.observations import (
    DetectionFrame,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Received,
    UnreadScan,
    kind_of,
)
from iveg.ngsi.codec import UNREAD, read_notification

DRAWN_APART_S: dict[type[Observation], float] = {
    Odometry: 0.1,
    LaserScan: 0.2,
    DetectionFrame: 0.2,
}
"""What viewers draw, and the least time between two of a robot (s)."""
_EARLY = 0.95
_DRAWN = Odometry | LaserScan | UnreadScan | DetectionFrame
_Stream = tuple[str, type[Observation]]


class Drawing:
    """Reads messages once more, for viewers alone.

    Args:
        apikey: First part of every measure topic.
        robots: The fleet.
    """

    def __init__(self, apikey: str, robots: Sequence[str]) -> None:
        self._robots = frozenset(robots)
        self._at = Instant(0.0, 0.0)
        self._found: list[Observation] = []
        self._due: dict[_Stream, float] = {}
        self._reader = DirectReader(
            apikey, robots, lambda: self._at, self._draw_received, lambda *_: None
        )

    def messages(self, came: Incoming) -> Iterator[tuple[Channel, bytes]]:
        """Foxglove's messages of an input; none of what cannot be read."""
        self._at, self._found = came.at, []
        with contextlib.suppress(UnreadableError):
            self._read(came)
        for one in self._found:
            for channel, value in foxglove.messages_of(one, came.at.wall):
                yield channel, orjson.dumps(value)

    def _read(self, came: Incoming) -> None:
        if came.sort is Sort.NOTIFICATION:
            _, reading = read_notification(came.payload, lambda *_: False, UNREAD)
            for one in reading.observations:
                with contextlib.suppress(UnreadableError):
                    self._draw(one)
        elif came.sort is Sort.MEASURE:
            stream = self._reader.stream(came.name)
            if stream is None or self._is_due(stream):
                self._reader.read(came.name, came.payload)

    def _draw_received(self, received: Received) -> None:
        self._draw(received.observation)

    def _draw(self, observation: Observation) -> None:
        """Have one drawn that is due.  Raises UnreadableError."""
        stream = observation.robot_id, kind_of(observation)
        is_ours = observation.robot_id in self._robots
        if is_ours and isinstance(observation, _DRAWN) and self._is_due(stream):
            one = _read(observation)
            if isinstance(one, LaserScan) and not one.ranges.size:
                # A twin without its numbers takes nobody's turn.
                return
            self._found.append(one)
            apart_s = DRAWN_APART_S[kind_of(observation)] * _EARLY
            self._due[stream] = self._at.mono + apart_s

    def _is_due(self, stream: _Stream) -> bool:
        is_drawn = stream[1] in DRAWN_APART_S
        return is_drawn and self._at.mono >= self._due.get(stream, float("-inf"))


def _read(observation: Observation) -> Observation:
    """The observation itself; a scan that nobody has read yet is read now."""
    return observation.read() if isinstance(observation, UnreadScan) else observation
