"""Latency of each message at each hop that it passes.

::

    robot's stamp ──Δt₁──> broker ──Δt₂──> Orion ──Δt₃──> decision ──Δt₄──> painted
                   uplink          fiware          iveg            screen
                  └────────── robot_orion ────────┘

The paper tabulates Δt₁ (robot to MQTT broker) and Δt₂ (broker to IoT Agent to Orion),
section "Temporal determinism".  Δt₃ and Δt₄ continue from there to the screen.  A
``Stream`` matches the copies of each message, a ``Series`` keeps the durations of one
hop, and ``PAPER`` has the numbers of the paper for comparison.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import accumulate
from math import ceil, log
from typing import Final, Literal, get_args

from iveg.domain.clock_offset import LONGEST_S, ClockOffset
from iveg.domain.observations import (
    DetectionFrame,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Origin,
    Received,
    kind_of,
)
from iveg.domain.transports import FIWARE

Segment = Literal["uplink", "fiware", "robot_orion", "iveg", "screen"]
"""``uplink`` Δt₁: from the robot's stamp to iVeg's own reading of the broker;
``fiware`` Δt₂: from there to Orion's notification at the boundary; ``robot_orion``:
the sum of both; ``iveg`` Δt₃: from the first copy to the decision; ``screen`` Δt₄: from
there to the frame that a page has drawn."""
SEGMENTS: Final[tuple[Segment, ...]] = get_args(Segment)

Data = Literal["odometry", "detections", "lidar"]
"""Rows of the paper's table; its "YOLOx" is ``detections``."""
DATA: Final[tuple[Data, ...]] = get_args(Data)

DATA_OF: Final[Mapping[type[Observation], Data]] = {
    Odometry: "odometry",
    DetectionFrame: "detections",
    LaserScan: "lidar",
}
"""Row of each type of observation; other types have none."""


# --- durations in little room ---------------------------------------------------------

_SHORTEST_S, _LONGEST_S = 1e-6, 600.0
"""Bounds of a counted duration (s); with them there are at most 1,012 bins."""
_GAMMA: Final = 1.01 / 0.99
"""Ratio of neighbouring bins: the relative error of a quantile is at most 1 %."""
_LOG_GAMMA: Final = log(_GAMMA)


@dataclass(slots=True)
class Sketch:
    """Durations of one hop, counted by logarithmic bins.

    The bins are those of DDSketch (Masson, Rim, Lee: VLDB 2019).

    Attributes:
        bins: Number of durations by bin.
        total: Sum of the durations (s).
    """

    bins: Counter[int] = field(default_factory=Counter)
    total: float = 0.0

    def add(self, duration_s: float) -> None:
        """Count a duration (s)."""
        inside = min(max(duration_s, _SHORTEST_S), _LONGEST_S)
        self.bins[ceil(log(inside) / _LOG_GAMMA)] += 1
        self.total += duration_s

    @property
    def count(self) -> int:
        """Number of durations."""
        return self.bins.total()

    @property
    def mean(self) -> float | None:
        """Mean duration (s); None without data."""
        return self.total / self.count if self.bins else None

    def quantile(self, share: float) -> float | None:
        """Quantile of a share (0 to 1) in s, within 1 %; None without data."""
        rank = share * (self.count - 1)
        counted = 0
        for number, count in sorted(self.bins.items()):
            counted += count
            if counted > rank:
                # This value is off by the same ratio from both ends of its bin.
                return 2.0 * _GAMMA**number / (1.0 + _GAMMA)
        return None

    def distribution(self) -> tuple[list[float], list[float]]:
        """Rising durations (s), and the share (0 to 1) of durations up to each."""
        numbers = sorted(self.bins)
        counts = accumulate(self.bins[number] for number in numbers)
        whole = self.count
        return [_GAMMA**number for number in numbers], [
            count / whole for count in counts
        ]


def merged(sketches: Iterable[Sketch]) -> Sketch:
    """Sketch of all durations of these sketches."""
    whole = Sketch()
    for sketch in sketches:
        whole.bins.update(sketch.bins)
        whole.total += sketch.total
    return whole


SLICE_S: Final = 60.0
_SLICES: Final = 15


class Series:
    """Durations of one hop, for one kind of data of one robot.

    Each minute has a sketch; the newest and fifteen whole minutes are kept.

    Attributes:
        count: Number of durations since the start.
        total: Sum of the durations since the start (s).
    """

    def __init__(self) -> None:
        self.count, self.total = 0, 0.0
        self._slices = deque([Sketch()], maxlen=_SLICES + 1)

    def add(self, duration_s: float) -> None:
        """Count the duration of a message (s)."""
        self.count += 1
        self.total += duration_s
        self._slices[-1].add(duration_s)

    def end_slice(self) -> None:
        """Begin the sketch of another minute."""
        self._slices.append(Sketch())

    def parts(self) -> list[Sketch]:
        """Sketches of the last 15 minutes; no sketch changes any more."""
        # The newest is copied, as another thread may read it while the loop adds to it.
        *whole, newest = self._slices
        return [*whole, merged([newest])]


# --- messages at their hops -----------------------------------------------------------

REMEMBERED: Final = 2048
"""Copies kept by stream: a minute of 30 messages a second; later FIWARE is down."""


class Stream:
    """One kind of data of one robot, followed from hop to hop by (boot, seq).

    The robot's own message at the broker and Orion's notification are two copies of one
    message, with the same (boot, seq).

    Attributes:
        segments: Durations by hop.
        decided_at: Decision on the newest message (monotonic, s); None: none yet.
    """

    def __init__(self, robot_id: str, data: Data, clock: ClockOffset) -> None:
        self.robot_id, self.data, self.clock = robot_id, data, clock
        self.segments: dict[Segment, Series] = {hop: Series() for hop in SEGMENTS}
        self.decided_at: float | None = None
        self._boot: str | None = None
        self._stamps: dict[Segment, float] = {}
        self._copies: dict[int, tuple[float, float | None] | None] = {}
        """By ``seq``, oldest first: time at the broker (monotonic, s) and Δt₁ (s) while
        Orion's copy is still to come; None after that."""

    def read_from_broker(
        self, origin: Origin, at: Instant, composed_at: float | None
    ) -> None:
        """Take a message from our own reading of the broker."""
        seq = self._follow(origin)
        # If Orion's copy was first, our reading is late and no time at the broker.
        if seq in self._copies:
            return
        took = self._transit("uplink", origin, at, composed_at)
        if seq is not None:
            self._remember(seq, (at.mono, took))

    def notified(self, origin: Origin, at: Instant, composed_at: float | None) -> None:
        """Take a message from a notification of Orion."""
        seq = self._follow(origin)
        if seq not in self._copies:
            self._transit("robot_orion", origin, at, composed_at)
            if seq is not None:
                self._remember(seq, None)
        elif (at_broker := self._copies[seq]) is not None:
            self._copies[seq] = None
            seen_at, uplink_s = at_broker
            took = at.mono - seen_at
            self.segments["fiware"].add(took)
            if uplink_s is not None:
                self.segments["robot_orion"].add(uplink_s + took)

    def decided(self, at: Instant, now: float) -> None:
        """Take the decision at ``now`` (monotonic, s) on a message of ``at``."""
        self.segments["iveg"].add(now - at.mono)
        self.decided_at = now

    def _follow(self, origin: Origin) -> int | None:
        """Number of a message in its boot; None where it has none."""
        if origin.boot is None or origin.seq is None:
            return None
        # A new boot counts from the start: its numbers would match copies of the old.
        if origin.boot != self._boot:
            self._boot = origin.boot
            self._copies.clear()
        return origin.seq

    def _remember(self, seq: int, at_broker: tuple[float, float | None] | None) -> None:
        self._copies[seq] = at_broker
        if len(self._copies) > REMEMBERED:
            del self._copies[next(iter(self._copies))]

    def _transit(
        self, hop: Segment, origin: Origin, at: Instant, composed_at: float | None
    ) -> float | None:
        """Time since the robot's stamp (s); None for a repeated or unusable stamp."""
        if origin.stamp_s is None or origin.stamp_s == self._stamps.get(hop):
            return None
        self._stamps[hop] = origin.stamp_s
        took = self.clock.time_message(origin.stamp_s, at, composed_at)
        if took is not None:
            self.segments[hop].add(took)
        return took


class LatencyWatch:
    """Latency of the whole fleet; boundaries call it for each message.

    A call takes a few microseconds (``benchmarks/latency_cost.py``), so that every
    message of twenty robots can be timed.

    Args:
        robots: Ids of the fleet.
        composed_at: Composition of a feedback (monotonic, s); None: unknown.

    Attributes:
        streams: Streams by robot and data, robot by robot.
    """

    def __init__(
        self, robots: Iterable[str], composed_at: Callable[..., float | None]
    ) -> None:
        self._composed_at = composed_at
        self.clocks = {robot_id: ClockOffset() for robot_id in robots}
        self.streams = {
            (robot_id, data): Stream(robot_id, data, clock)
            for robot_id, clock in self.clocks.items()
            for data in DATA
        }
        self._slice_at: float | None = None

    def arrived(self, received: Received) -> None:
        """Take a copy of a message, of either transport."""
        stream = self._stream(received)
        if stream is None:
            return
        origin = received.observation.origin
        composed_at = self._composed_at(*origin.echoes)
        is_fiware = received.transport == FIWARE.id
        tap = stream.notified if is_fiware else stream.read_from_broker
        tap(origin, received.at, composed_at)

    def decided(self, taken: Iterable[Received], now: Instant) -> None:
        """Take messages with which the fleet has just been judged."""
        for received in taken:
            stream = self._stream(received)
            if stream is not None:
                stream.decided(received.at, now.mono)

    def decided_at(self, robot_id: str, data: Data) -> float | None:
        """Decision on the newest message (monotonic, s); None: none yet."""
        stream = self.streams.get((robot_id, data))
        return None if stream is None else stream.decided_at

    def painted(
        self, robot_id: str, data: Data, decided_at: float, painted_at: float
    ) -> None:
        """Take a drawing of a page (monotonic s of the server)."""
        took = painted_at - decided_at
        stream = self.streams.get((robot_id, data))
        # The moment comes from a browser: an impossible span must not spoil the mean.
        if stream is not None and 0.0 <= took <= LONGEST_S:
            stream.segments["screen"].add(took)

    def tick(self, now: Instant) -> None:
        """Let time pass; each minute begins new sketches."""
        if self._slice_at is None:
            self._slice_at = now.mono
        if now.mono - self._slice_at < SLICE_S:
            return
        self._slice_at = now.mono
        for stream in self.streams.values():
            for series in stream.segments.values():
                series.end_slice()

    def _stream(self, received: Received) -> Stream | None:
        data = DATA_OF.get(kind_of(received.observation))
        if data is None or received.is_query_answer:
            return None
        return self.streams.get((received.observation.robot_id, data))


# --- the table ------------------------------------------------------------------------

Cell = tuple[Data, Segment]


def collect(
    streams: Iterable[Stream], robot_id: str | None = None
) -> dict[Cell, list[Sketch]]:
    """Sketches of one robot, or of all; called in the loop."""
    cells: dict[Cell, list[Sketch]] = {
        (data, hop): [] for data in DATA for hop in SEGMENTS
    }
    for stream in streams:
        if robot_id in (None, stream.robot_id):
            for hop, series in stream.segments.items():
                cells[stream.data, hop] += series.parts()
    return cells


def merge(parts: Mapping[Cell, list[Sketch]]) -> dict[Cell, Sketch]:
    """One sketch for each cell; may be called in any thread."""
    return {cell: merged(sketches) for cell, sketches in parts.items()}


Place = Literal["simulation", "field"]


@dataclass(frozen=True, slots=True)
class PaperLatency:
    """One row of the paper's table (ms); a total at P95 is the sum of two P95."""

    uplink_mean: float
    uplink_p95: float
    fiware_mean: float
    fiware_p95: float
    total_mean: float
    total_p95: float


PAPER: Final[dict[Place, dict[Data, PaperLatency]]] = {
    "simulation": {
        "odometry": PaperLatency(3.8, 11.2, 98.4, 182.3, 102.2, 193.5),
        "detections": PaperLatency(4.1, 12.5, 101.2, 188.7, 105.3, 201.2),
        "lidar": PaperLatency(4.3, 13.1, 96.1, 155.4, 100.4, 168.5),
    },
    "field": {
        "odometry": PaperLatency(16.9, 103.9, 121.3, 212.6, 138.2, 316.5),
        "detections": PaperLatency(16.2, 101.0, 119.2, 214.9, 135.4, 315.8),
        "lidar": PaperLatency(17.4, 97.2, 117.0, 168.6, 134.4, 265.8),
    },
}
"""The paper's two tables, both of a real FIWARE with MongoDB: in simulation on a local
network, and in the AgroConnect greenhouse (n > 10,000 for Δt₁, n = 598 for Δt₂)."""
