"""Telemetry for one browser: the newest values, at the browser's own pace.

Positions go as often as the page paints.  Other parts go as often as eyes need: a scan
or a detection frame is looked at, not measured, and digits that change more than ten
times a second cannot be read.

Buffers of the kernel, of the server and of the browser are queues without a size, and
telemetry that waits in them shows the past.  So the page says which frame it has
painted, and no more than a window of unpainted frames is ever sent: further changes
wait in slots, where the newest wins.  The same reports tell Δt₄, from the decision to
the drawn frame.  Only frames that the server sent itself are measured, so a page can be
wrong about the moment alone; an impossible moment is not used.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from iveg.domain.latency import Data, LatencyWatch
from iveg.domain.observations import Instant
from iveg.vital import topics
from iveg.vital.publish import Subscriber
from iveg.web.live.telemetry import LIST_S, Part, TelemetryEncoder, write_frame
from iveg.web.presses import read_number

SUBPROTOCOL: Final = "iveg.2"
"""A browser asks for paced telemetry by this WebSocket subprotocol."""

FRAMES: Final = 8
"""Spread over the round trip: 300 ms away a page still gets 26 frames a second."""
BYTES: Final = 24_576
"""Heavy content in them (scans, detections, people): 0.2 s of a line of 1 Mbit/s."""
GAP_S: Final = 0.002
"""Frames nearer to each other would cost more than the freshness that they bring."""
ROBOT_GAP_S: Final = 0.0006
"""Gap for each robot of the fleet, where that is more: 6 ms with ten."""
SLOW_FRAME_S: Final = 0.03
"""A page that draws for longer than this twice is slow."""

_LEARNS: Final = 0.5


class _Sent(NamedTuple):
    number: int
    heavy: int
    at: float


class CreditWindow:
    """The frames that one page has not painted yet; times are monotonic (s).

    Attributes:
        gap_s: Least time between two frames.
    """

    def __init__(self) -> None:
        self.gap_s = GAP_S
        self._sent: deque[_Sent] = deque()
        self._number = 0
        self._sent_at = float("-inf")
        self._round_trip_s = 0.0
        self._line_s: float | None = None

    @property
    def next_number(self) -> int:
        """Number of the next frame, from 1."""
        return self._number + 1

    @property
    def opens_at(self) -> float:
        """When the next frame may go; ``inf``: not before one is painted."""
        if len(self._sent) >= FRAMES:
            return float("inf")
        return self._sent_at + (self._apart_s if self._sent else self.gap_s)

    @property
    def _apart_s(self) -> float:
        """Between frames of which none is painted (s).

        Many on a long line, so that it is used; two while a page draws that takes
        longer than screens do: more would only keep it from drawing.
        """
        if self._line_s is None:
            return max(self.gap_s, self._round_trip_s / FRAMES)
        half_s = (self._round_trip_s - self._line_s) / 2
        draws_s = half_s if half_s > SLOW_FRAME_S else 0.0
        return max(self.gap_s, self._line_s / FRAMES, draws_s)

    @property
    def room(self) -> int:
        """Number of heavy bytes that may go with it."""
        return BYTES - sum(one.heavy for one in self._sent)

    def sent(self, heavy: int, now: float) -> None:
        """One more frame is on its way, ``heavy`` bytes of it heavy."""
        self._number += 1
        self._sent_at = now
        self._sent.append(_Sent(self._number, heavy, now))

    def painted(self, number: object, now: float, within: object = None) -> bool:
        """The page has painted this frame and all before; whether that was news.

        ``within``, in its own words, is half its shortest round trip (s).
        """
        if type(number) is not int or number > self._number:
            return False
        if not self._sent or number < self._sent[0].number:
            return False
        # The oldest of them says how long the credit has been out.
        away_s = now - self._sent[0].at
        self._round_trip_s += _LEARNS * (away_s - self._round_trip_s)
        while self._sent and self._sent[0].number <= number:
            self._sent.popleft()
        half_s = _bounded(within, self._round_trip_s / 2)
        self._line_s = None if half_s is None else 2 * half_s
        return True


def _bounded(value: object, most: float) -> float | None:
    """A time that a page has sent; None where it is none, or longer than possible."""
    number = read_number(value)
    return number if number is not None and 0.0 <= number <= most else None


TRUSTED_S: Final = 0.1
"""Half the shortest round trip (s): how well a page knows the server's clock."""
SAMPLE_S: Final = 0.1
"""Between two samples of one topic and page: the hop is paced, and so is this."""
_SLACK_S: Final = 0.05

_MEASURED: Final[Mapping[topics.Topic, Data]] = {
    topics.ROBOT: "odometry",
    topics.SCAN: "lidar",
    topics.DETECTIONS: "detections",
}
_Sample = tuple[str, Data, float]


class Painting:
    """The frames of one page that are on their way, and what was decided in them."""

    def __init__(self, watch: LatencyWatch) -> None:
        self._watch = watch
        self._on_way: deque[tuple[int, float, list[_Sample]]] = deque(maxlen=FRAMES)
        self._sampled: dict[str, float] = {}
        self._samples: list[_Sample] = []

    def adds(self, topic: str, now: float) -> None:
        """Note that a topic goes with the next frame (``now`` monotonic, s)."""
        if now - self._sampled.get(topic, float("-inf")) < SAMPLE_S:
            return
        row, robot_id = topics.find(topic)
        data = _MEASURED.get(row)
        if data is None:
            return
        decided_at = self._watch.decided_at(robot_id, data)
        if decided_at is not None:
            self._sampled[topic] = now
            self._samples.append((robot_id, data, decided_at))

    def sent(self, number: int, now: float) -> None:
        """Note that the frame was sent."""
        self._on_way.append((number, now, self._samples))
        self._samples = []

    def painted(self, number: int, at: object, within: object, now: float) -> None:
        """Take a page's report that it drew a frame, and all before, at a moment.

        Args:
            number: Of the frame; it was on its way.
            at: When, on the server's monotonic clock (s); None: nothing was drawn.
            within: How wrong that may be (s).
            now: When this was heard (monotonic, s).
        """
        drawn_at, doubt_s = read_number(at), read_number(within)
        while self._on_way and self._on_way[0][0] <= number:
            _, sent_at, samples = self._on_way.popleft()
            if at is not None:
                for sample in samples:
                    self._judge(sample, sent_at, drawn_at, doubt_s, now)

    def _judge(
        self,
        sample: _Sample,
        sent_at: float,
        at: float | None,
        within: float | None,
        now: float,
    ) -> None:
        robot_id, data, decided_at = sample
        if at is None or within is None or not 0.0 <= within <= TRUSTED_S:
            return
        if sent_at - within - _SLACK_S <= at <= now + within + _SLACK_S:
            self._watch.painted(robot_id, data, decided_at, at)


PICTURE_S: Final = 1 / 15
"""Between two scans, or detection frames, of one robot."""
STATE_S: Final = 0.2
"""Between two states of one robot, whose digits are read."""
STATES_AFTER_S: Final = LIST_S / 2
"""States of robots come this long after lists of people: each takes long to write."""

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
        self._moved: dict[str, None] = {}
        """Robots, by topic; their positions go with each frame."""
        self._robots: set[str] = set()
        """All that have ever moved, by topic."""
        self._read_outs: dict[str, float] = {}
        self._pictures: dict[str, float] = {}
        """Changed topics, and when each may be sent (monotonic, s)."""
        self._sent: dict[str, tuple[int, float]] = {}
        self._is_full = False
        self._ready: _Frame | None = None
        """Begun for the next frame."""

    def painted(self, number: object, now: float, report: dict[str, object]) -> None:
        """The page has painted a frame: there may be credit for another.

        ``report``, all in its own words: ``at`` and ``within`` (s) are when; without
        ``at`` it drew nothing.
        """
        within = report.get("within")
        if type(number) is int and self.window.painted(number, now, within):
            self._painting.painted(number, report.get("at"), within, now)
            self._is_full = False
            self._subscriber.wake()

    def wait_s(self, now: float) -> float | None:
        """Time until there may be a frame (s); None: until something changes.

        Meanwhile a change of telemetry wakes nobody unless it could be sent at once.
        """
        self._absorb()
        opens_at = self.window.opens_at
        self._subscriber.wants_telemetry = opens_at <= now
        wake_at = opens_at if opens_at > now else self._due_at()
        return None if wake_at == _INF else max(0.0, wake_at - now)

    def next_frame(self, now: Instant) -> bytes | None:
        """A frame of what moved, was written ahead or is a picture; None: not now."""
        if self.window.opens_at > now.mono:
            return None
        self._absorb()
        frame = self._begun()
        self._add_moves(frame, now)
        # People and states before pictures, where there is no room for all.
        if self._ready is None:
            self._add_due(frame, self._pictures, now)
        self._is_full = frame.is_full
        if frame.is_empty:
            return None
        data = frame.write(self.window.next_number)
        self._painting.sent(self.window.next_number, now.mono)
        self.window.sent(frame.heavy, now.mono)
        return data

    def write_ahead(self, now: Instant) -> None:
        """Write the read-outs that are due, for the next frame.

        They take long to write, and poses must not wait for that.
        """
        if self._ready is not None or self.window.opens_at == _INF:
            return
        self._absorb()
        self._encoder.begin()
        ready = _Frame(BYTES)
        self._add_due(ready, self._read_outs, now)
        self._ready = None if ready.is_empty else ready

    def _begun(self) -> "_Frame":
        """The frame that was written ahead, once there is room for it; else a new one.

        Where it waits, so does all that is heavy.
        """
        room, ready = self.window.room, self._ready
        if ready is None:
            return _Frame(room)
        if ready.heavy <= room or room == BYTES:
            self._ready = None
            return ready
        waits = _Frame(0)
        waits.is_full = True
        return waits

    def _absorb(self) -> None:
        for topic in self._subscriber.drain_telemetry():
            row, robot_id = topics.find(topic)
            if row is topics.ROBOT:
                self._moved[topic] = None
                self._robots.add(topic)
                self._note(
                    self._read_outs, topics.ROBOT_STATE.of(robot_id), _next_state
                )
            elif row.pace == "read-out":
                self._note(self._read_outs, topic, self._next_list)
            else:
                self._note(self._pictures, topic, _next_picture)
        self.window.gap_s = max(GAP_S, ROBOT_GAP_S * len(self._robots))

    def _note(
        self,
        waiting: dict[str, float],
        topic: str,
        next_after: Callable[[float], float],
    ) -> None:
        if topic not in waiting:
            sent = self._sent.get(topic)
            waiting[topic] = -_INF if sent is None else next_after(sent[1])

    def _next_list(self, sent_at: float) -> float:
        """When a list of people may be sent again (monotonic, s)."""
        return _next_beat(sent_at + self._encoder.lists_apart_s - LIST_S, LIST_S)

    def _due_at(self) -> float:
        """Earliest time of a waiting part; parts without room wait for credit."""
        if self._moved:
            return -_INF
        if self._is_full:
            return _INF
        if self._ready is not None:
            return -_INF
        parts = min(self._read_outs.values(), default=_INF)
        return min(parts, min(self._pictures.values(), default=_INF))

    def _add_moves(self, frame: "_Frame", now: Instant) -> None:
        for topic in self._moved:
            move = self._encoder.move(topics.find(topic)[1], now)
            if move is not None and move.version != self._version(topic):
                frame.moves.append(move.head)
                self._sent[topic] = move.version, now.mono
                self._painting.adds(topic, now.mono)
        self._moved.clear()

    def _add_due(
        self, frame: "_Frame", waiting: dict[str, float], now: Instant
    ) -> None:
        for topic in [one for one, due in waiting.items() if due <= now.mono]:
            version = self._version(topic)
            part = self._part(topic, version, now)
            if part is None or part.version == version:
                del waiting[topic]
            elif frame.add(part):
                del waiting[topic]
                self._sent[topic] = part.version, now.mono
                self._painting.adds(topic, now.mono)

    def _version(self, topic: str) -> int:
        sent = self._sent.get(topic)
        return -1 if sent is None else sent[0]

    def _part(self, topic: str, since: int, now: Instant) -> Part | None:
        row, key = topics.find(topic)
        if row is topics.PEOPLE:
            return self._encoder.people(since, now)
        if row is topics.ROBOT_STATE:
            return self._encoder.state(key, since, now)
        return self._encoder.part(topic, now)


class _Frame:
    """One frame in the making."""

    def __init__(self, room: int) -> None:
        self._room = room
        self.moves: list[bytes] = []
        self._parts: list[bytes] = []
        self._scans: list[Part] = []
        self.heavy = 0
        self.is_full = False

    @property
    def is_empty(self) -> bool:
        """Whether the frame has no content."""
        return not (self.moves or self._parts or self._scans)

    def add(self, part: Part) -> bool:
        """Add a part; False where too much would be on its way at once."""
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
        """The frame as it is sent."""
        head = b'{"frame":%d,"parts":[%b],"moves":[%b],"scans":[%b]}' % (
            number,
            b",".join(self._parts),
            b",".join(self.moves),
            b",".join(scan.head for scan in self._scans),
        )
        return write_frame(head, (scan.body for scan in self._scans))


def _next_picture(sent_at: float) -> float:
    """When a scan or a detection frame may be sent again (monotonic, s)."""
    return sent_at + PICTURE_S


def _next_beat(sent_at: float, apart_s: float) -> float:
    """When a read-out may be sent again (monotonic, s).

    Read-outs of a kind go together, at the same moments to all browsers: what takes
    all robots and people is worked out once for all of them.
    """
    return (math.floor(sent_at / apart_s + 1e-6) + 1) * apart_s


def _next_state(sent_at: float) -> float:
    """When the state of a robot may be sent again (monotonic, s)."""
    return _next_beat(sent_at - STATES_AFTER_S, STATE_S) + STATES_AFTER_S
