"""Telemetry for one browser: the newest values, at the browser's own pace.

Positions go as often as the page paints.  Other parts go as often as eyes need: a
person looks at a scan or a detection frame, and cannot read digits that change more
than ten times a second.

Buffers of the kernel, of the server and of the browser are queues without a size, and
telemetry that waits in them is old.  So the page reports its newest painted frame, and
a few unpainted frames at most are on their way: further changes wait in slots, where
the newest wins.  The same reports tell Δt₄, from the decision to the drawn
frame.  Only frames that the server sent itself are measured, so a page can be wrong
about the moment alone; an impossible moment is not used.
"""

import math
from collections import deque
from collections.abc import Mapping
from typing import Final

from iveg.domain.latency import Data, LatencyWatch
from iveg.domain.observations import Instant
from iveg.vital import topics
from iveg.vital.publish import Subscriber, drain
from iveg.web.live.telemetry import LIST_S, Part, TelemetryEncoder, write_frame
from iveg.web.presses import read_number

SUBPROTOCOL: Final = "iveg.2"
"""A browser asks for paced telemetry by this WebSocket subprotocol."""

FRAMES: Final = 6
"""Unpainted frames on their way: one alone would add a round trip to every age."""
CREDIT: Final = 16_000
"""Unpainted bytes from which on frames have positions alone: they would wait 32 ms
behind as many bytes on a radio of 4 Mbit/s."""
GAP_S: Final = 0.004
"""Least time between two frames (s): closer frames cost more than they gain."""

_LEARNS: Final = 0.5


class CreditWindow:
    """The frames that one page has not painted yet; times are monotonic (s)."""

    def __init__(self) -> None:
        self._unpainted: deque[tuple[int, float, int]] = deque()
        """Number of each frame, when it was sent (monotonic, s), and its bytes."""
        self._number = 0
        self._sent_at = float("-inf")
        self._round_trip_s = 0.0

    @property
    def next_number(self) -> int:
        """Number of the next frame, from 1."""
        return self._number + 1

    @property
    def credit(self) -> int:
        """Bytes that may be sent before the page paints another frame."""
        return CREDIT - sum(size for _, _, size in self._unpainted)

    @property
    def opens_at(self) -> float:
        """Earliest time of the next frame (monotonic, s); ``inf``: wait for a report.

        Frames are spread over the round trip; sent together they would age together.
        """
        if len(self._unpainted) >= FRAMES:
            return float("inf")
        spread_s = self._round_trip_s / FRAMES if self._unpainted else 0.0
        return self._sent_at + max(GAP_S, spread_s)

    def sent(self, size: int, now: float) -> None:
        """One more frame of this size (bytes) is on its way."""
        self._number, self._sent_at = self._number + 1, now
        self._unpainted.append((self._number, now, size))

    def painted(self, number: object, now: float) -> bool:
        """Note that a page painted a frame and all before; returns False if known."""
        # A page may report anything; only frames that were sent give credit.
        if type(number) is not int or number > self._number:
            return False
        if not self._unpainted or number < self._unpainted[0][0]:
            return False
        # The oldest of these frames shows the age of the credit.
        away_s = now - self._unpainted[0][1]
        self._round_trip_s += _LEARNS * (away_s - self._round_trip_s)
        while self._unpainted and self._unpainted[0][0] <= number:
            self._unpainted.popleft()
        return True


TRUSTED_S: Final = 0.1
"""Largest error of a page about the server's clock (s): half a round trip."""
SAMPLE_S: Final = 0.1
"""Time between two latency samples of one topic and page (s)."""
_SLACK_S: Final = 0.05

_MEASURED: Final[Mapping[topics.Topic, Data]] = {
    topics.ROBOT: "odometry",
    topics.SCAN: "lidar",
    topics.DETECTIONS: "detections",
}
_Sample = tuple[str, Data, float]


class Painting:
    """Frames on their way to a page, with the decisions whose latency they measure."""

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
            number: Number of a frame that was on its way.
            at: Moment on the server's monotonic clock (s); None: nothing was drawn.
            within: Greatest error of ``at`` (s).
            now: Moment of the report's arrival (monotonic, s).
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
        # A page that knows the clock badly would make the hop look better or worse.
        if at is None or within is None or not 0.0 <= within <= TRUSTED_S:
            return
        # Drawn before it was sent, or after the report came, is impossible.
        if sent_at - within - _SLACK_S <= at <= now + within + _SLACK_S:
            self._watch.painted(robot_id, data, decided_at, at)


PICTURE_S: Final = 1 / 15
"""Time between two scans, or detection frames, of one robot (s)."""
STATE_S: Final = 0.2
"""Time between two states of one robot, whose digits people read (s)."""
STATES_AFTER_S: Final = LIST_S / 2
"""Delay of robots' states after lists of people (s): both take long to encode."""

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
        self._waiting: dict[str, float] = {}
        """Other changed topics, and when each may be sent (monotonic, s)."""
        self._sent: dict[str, tuple[int, float]] = {}

    def painted(self, number: object, now: float, report: dict[str, object]) -> None:
        """Take a page's report that it painted a frame, which may free credit.

        ``report`` is the page's own message: it drew at ``at`` (s), within ``within``
        (s); without ``at`` it drew nothing.
        """
        if type(number) is int and self.window.painted(number, now):
            self._painting.painted(number, report.get("at"), report.get("within"), now)
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
        """A frame of all that moved and all that is due; None: not now."""
        if self.window.opens_at > now.mono:
            return None
        self._absorb()
        self._encoder.begin()
        moves, parts = self._moves(now), self._due_parts(now)
        if not moves and not parts:
            return None
        data = _write(self.window.next_number, moves, parts)
        self._painting.sent(self.window.next_number, now.mono)
        self.window.sent(len(data), now.mono)
        return data

    def _absorb(self) -> None:
        for topic in drain(self._subscriber.telemetry):
            row, robot_id = topics.find(topic)
            if row is topics.ROBOT:
                # The position goes with the next frame, the other members when due.
                self._moved[topic] = None
                topic = topics.ROBOT_STATE.for_id(robot_id)
            if topic not in self._waiting:
                self._waiting[topic] = self._next_at(topic)

    def _next_at(self, topic: str) -> float:
        """Earliest time of a topic's next send (monotonic, s)."""
        if topic not in self._sent:
            return -_INF
        row, sent_at = topics.find(topic)[0], self._sent[topic][1]
        if row is topics.ROBOT_STATE:
            return _next_beat(sent_at - STATES_AFTER_S, STATE_S) + STATES_AFTER_S
        if row is topics.PEOPLE:
            return _next_beat(sent_at + self._encoder.lists_apart_s - LIST_S, LIST_S)
        return sent_at + PICTURE_S

    def _due_at(self) -> float:
        """Earliest time at which a waiting topic may go."""
        # Without credit pictures wait for a report, which wakes the line.
        waiting = self._waiting.values() if self.window.credit > 0 else ()
        return -_INF if self._moved else min(waiting, default=_INF)

    def _moves(self, now: Instant) -> list[bytes]:
        moves = []
        for topic in self._moved:
            move = self._encoder.move(topics.find(topic)[1], now)
            if move is not None and move.version != self._version(topic):
                moves.append(move.head)
                self._note_sent(topic, move, now)
        self._moved.clear()
        return moves

    def _due_parts(self, now: Instant) -> list[Part]:
        parts = []
        room = self.window.credit
        for topic in [name for name, due in self._waiting.items() if due <= now.mono]:
            if room <= 0:
                break
            del self._waiting[topic]
            version = self._version(topic)
            part = self._part(topic, version, now)
            if part is not None and part.version != version:
                parts.append(part)
                room -= len(part.head) + len(part.body)
                self._note_sent(topic, part, now)
        return parts

    def _note_sent(self, topic: str, part: Part, now: Instant) -> None:
        self._sent[topic] = part.version, now.mono
        self._painting.adds(topic, now.mono)

    def _version(self, topic: str) -> int:
        sent_version = self._sent.get(topic)
        return -1 if sent_version is None else sent_version[0]

    def _part(self, topic: str, since: int, now: Instant) -> Part | None:
        row, key = topics.find(topic)
        if row is topics.PEOPLE:
            return self._encoder.people(since, now)
        if row is topics.ROBOT_STATE:
            return self._encoder.state(key, since, now)
        return self._encoder.part(topic, now)


def _write(number: int, moves: list[bytes], parts: list[Part]) -> bytes:
    """The frame as it is sent; only scans have a body."""
    scans = [part for part in parts if part.body]
    head = b'{"frame":%d,"parts":[%b],"moves":[%b],"scans":[%b]}' % (
        number,
        b",".join(part.head for part in parts if not part.body),
        b",".join(moves),
        b",".join(scan.head for scan in scans),
    )
    return write_frame(head, (scan.body for scan in scans))


def _next_beat(sent_at: float, apart_s: float) -> float:
    """Next common moment of a kind of read-out (monotonic, s).

    All browsers are sent a kind at the same moments, so the state of all robots and
    people is computed once for all browsers.
    """
    # The addend: rounding must not take a send at a beat for one just before it.
    return (math.floor(sent_at / apart_s + 1e-6) + 1) * apart_s
