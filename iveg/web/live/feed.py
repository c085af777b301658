"""Telemetry for one browser: the newest values, at the browser's own pace.

Positions go as often as the page paints.  Other parts go as often as eyes need: a scan
or a detection frame is looked at, not measured, and digits that change more than ten
times a second cannot be read.
"""

import math
from typing import Final

from iveg.domain.observations import Instant
from iveg.pipeline import topics
from iveg.pipeline.publish import Subscriber
from iveg.pipeline.topics import is_telemetry
from iveg.web.live.pacing import BYTES, CreditWindow
from iveg.web.live.painting import Painting
from iveg.web.live.telemetry import Part, TelemetryEncoder

PICTURE_S: Final = 1 / 15
"""Between two scans, or detection frames, of one robot."""
READ_OUT_S: Final = 0.1
"""Between two states of one robot, or lists of people."""

_NEVER: Final = -1, float("-inf")
_INF: Final = float("inf")


class TelemetryFeed:
    """Makes the frames of one browser from the topics that have changed for it."""

    def __init__(
        self, encoder: TelemetryEncoder, subscriber: Subscriber, painting: Painting
    ) -> None:
        self.window = CreditWindow()
        self._painting = painting
        self._encoder = encoder
        self._subscriber = subscriber
        self._waiting: dict[str, None] = {}
        self._told: dict[str, tuple[int, float]] = {}
        self._is_full = False

    def painted(
        self, number: object, now: float, at: object = None, within: object = None
    ) -> None:
        """The page has painted a frame: there may be credit for another.

        ``at`` and ``within`` (s) are when, in its own words; None: it drew nothing.
        """
        if type(number) is int and self.window.painted(number, now):
            self._painting.painted(number, at, within, now)
            self._is_full = False
            self._subscriber.wake()

    def wait_s(self, now: float) -> float | None:
        """How long until there may be a frame (s); None: until something changes.

        Meanwhile a change of telemetry wakes nobody unless it could be sent at once.
        """
        self._absorb()
        opens_at = self.window.opens_at
        self._subscriber.wants_telemetry = opens_at <= now
        wake_at = opens_at if opens_at > now else self._due_at()
        return None if wake_at == _INF else max(0.0, wake_at - now)

    def next_frame(self, now: Instant) -> bytes | None:
        """A frame of the newest of everything that is due; None: not now."""
        self._absorb()
        if self.window.opens_at > now.mono:
            return None
        self._encoder.begin()
        frame = _Frame(self.window.room)
        for topic in sorted(self._waiting, key=_rank):
            self._add(frame, topic, now)
        self._is_full = frame.is_full
        if frame.is_empty:
            return None
        told = frame.write(self.window.next_number)
        self._painting.sent(self.window.next_number, now.mono)
        self.window.sent(frame.heavy, now.mono)
        return told

    def _absorb(self) -> None:
        for topic in self._subscriber.take_topics(is_telemetry):
            self._waiting[topic] = None
            row, robot_id = topics.find(topic)
            if row is topics.ROBOT:
                self._waiting[topics.ROBOT_STATE.of(robot_id)] = None

    def _due_at(self) -> float:
        """When the first waiting part may go; parts without room wait for credit."""
        times = (
            _next_after(topic, self._told.get(topic, _NEVER)[1])
            for topic in self._waiting
            if _is_robot(topic) or not self._is_full
        )
        return min(times, default=_INF)

    def _add(self, frame: "_Frame", topic: str, now: Instant) -> None:
        version, published_at = self._told.get(topic, _NEVER)
        if _next_after(topic, published_at) > now.mono:
            return
        part = self._part(topic, version, now)
        if part is None or part.version == version:
            del self._waiting[topic]
        elif frame.take(topic, part):
            del self._waiting[topic]
            self._told[topic] = part.version, now.mono
            self._painting.adds(topic, now.mono)

    def _part(self, topic: str, since: int, now: Instant) -> Part | None:
        row, key = topics.find(topic)
        match row.pace:
            case "frame":
                return self._encoder.move(key, now)
            case "read-out" if row is topics.PEOPLE:
                return self._encoder.people(since, now)
            case "read-out":
                return self._encoder.state(key, since, now)
            case _:
                return self._encoder.part(topic, now)


class _Frame:
    """One frame in the making."""

    def __init__(self, room: int) -> None:
        self._room = room
        self._moves: list[bytes] = []
        self._parts: list[bytes] = []
        self._scans: list[Part] = []
        self.heavy = 0
        self.is_full = False

    @property
    def is_empty(self) -> bool:
        """Whether the frame has no content."""
        return not (self._moves or self._parts or self._scans)

    def take(self, topic: str, part: Part) -> bool:
        """Add a part; False where too much would be on its way at once."""
        if _is_robot(topic):
            self._moves.append(part.head)
            return True
        # One that is larger than all room goes when nothing heavy is on its way.
        is_first = self._room == BYTES and self.heavy == 0
        if self.heavy + part.size > self._room and not is_first:
            self.is_full = True
            return False
        self.heavy += part.size
        if part.body:
            self._scans.append(part)
        else:
            self._parts.append(part.head)
        return True

    def write(self, number: int) -> bytes:
        """``uint32`` length of the JSON, the JSON padded with spaces, the bodies."""
        head = b'{"frame":%d,"parts":[%b],"moves":[%b],"scans":[%b]}' % (
            number,
            b",".join(self._parts),
            b",".join(self._moves),
            b",".join(scan.head for scan in self._scans),
        )
        head += b" " * (-len(head) % 4)
        bodies = (scan.body for scan in self._scans)
        return b"".join((len(head).to_bytes(4, "little"), head, *bodies))


def _is_robot(topic: str) -> bool:
    return topics.find(topic)[0] is topics.ROBOT


def _next_after(topic: str, published_at: float) -> float:
    """When a topic may be told again (monotonic, s).

    Read-outs go together, at the same moments to all browsers: what takes all robots
    and people is worked out once for all of them.
    """
    if _is_robot(topic) or published_at == _NEVER[1]:
        return published_at
    if _rank(topic):
        return published_at + PICTURE_S
    return (math.floor(published_at / READ_OUT_S + 1e-6) + 1) * READ_OUT_S


def _rank(topic: str) -> int:
    """People and states before pictures, where there is no room for all."""
    return 1 if topics.find(topic)[0].pace == "picture" else 0
