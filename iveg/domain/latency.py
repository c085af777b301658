"""Where the milliseconds go: each message timed at each hop that it passed.

::

    robot's stamp ──Δt₁──> broker ──Δt₂──> Orion ──Δt₃──> decision ──Δt₄──> painted
                   uplink          fiware          iveg            screen
                  └────────── robot_orion ────────┘

The paper tabulates Δt₁ (robot to MQTT broker) and Δt₂ (broker to IoT Agent to Orion),
section "Temporal determinism"; Δt₃ and Δt₄ go on from there to the eye.  A ``Stream``
matches the copies of each message, a ``Series`` keeps the durations of one hop, and
``PAPER`` has the numbers to stand beside them.
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
"""``uplink`` Δt₁: the robot's stamp to iVeg's own reading of the broker; ``fiware``
Δt₂: from there to Orion's notification at the boundary; ``robot_orion`` both as one
number; ``iveg`` Δt₃: whichever copy was first, to the decision; ``screen`` Δt₄: from
there to the frame that a page has drawn."""
SEGMENTS: Final[tuple[Segment, ...]] = get_args(Segment)

Data = Literal["odometry", "detections", "lidar"]
"""The paper's three rows; its "YOLOx" is ``detections``."""
DATA: Final[tuple[Data, ...]] = get_args(Data)

_DATA: Final[dict[type, Data]] = {
    Odometry: "odometry",
    DetectionFrame: "detections",
    LaserScan: "lidar",
}


def data_of(kind: type[Observation]) -> Data | None:
    """The row of the table that a kind of observation belongs to; None for no row."""
    return _DATA.get(kind)


# --- durations in little room ---------------------------------------------------------

_SHORTEST_S, _LONGEST_S = 1e-6, 600.0
"""Shorter and longer ones count as these, which bounds the bins to 1,012."""
_GAMMA: Final = 1.01 / 0.99
"""Ratio of neighbouring bins: a quantile is off by 1 % of itself at most."""
_LOG_GAMMA: Final = log(_GAMMA)


@dataclass(slots=True)
class Sketch:
    """Durations of one hop, counted by logarithmic bins.

    The bins are DDSketch's (Masson, Rim, Lee: VLDB 2019).

    Attributes:
        bins: Bin → number of durations in it.
        total: Sum of the durations (s).
    """

    bins: Counter[int] = field(default_factory=Counter)
    total: float = 0.0

    def add(self, duration_s: float) -> None:
        """Count one more, not below zero."""
        inside = min(max(duration_s, _SHORTEST_S), _LONGEST_S)
        self.bins[ceil(log(inside) / _LOG_GAMMA)] += 1
        self.total += duration_s

    def include(self, other: "Sketch") -> None:
        """Count those of another, too."""
        self.bins.update(other.bins)
        self.total += other.total

    @property
    def count(self) -> int:
        """Number of durations."""
        return self.bins.total()

    @property
    def mean(self) -> float | None:
        """(s); None of nothing."""
        return self.total / self.count if self.bins else None

    def quantile(self, share: float) -> float | None:
        """The quantile of a share (0 to 1) (s), within 1 %; None without data."""
        rank = share * (self.count - 1)
        seen = 0
        for number, count in sorted(self.bins.items()):
            seen += count
            if seen > rank:
                return 2.0 * _GAMMA**number / (1.0 + _GAMMA)
        return None

    def distribution(self) -> tuple[list[float], list[float]]:
        """Rising durations (s), and the share (0 to 1) that did not exceed each."""
        numbers = sorted(self.bins)
        counts = accumulate(self.bins[number] for number in numbers)
        whole = self.count
        return [_GAMMA**one for one in numbers], [count / whole for count in counts]


def merged(sketches: Iterable[Sketch]) -> Sketch:
    """All of them as one: as if their durations had gone into it."""
    whole = Sketch()
    for sketch in sketches:
        whole.include(sketch)
    return whole


SLICE_S: Final = 60.0
_SLICES: Final = 15


class Series:
    """Durations of one hop, for one kind of data of one robot.

    A minute fills one sketch; fifteen whole ones and the newest are kept.

    Attributes:
        count: Number of durations since the start; ``total`` their sum (s).
    """

    def __init__(self) -> None:
        self.count, self.total = 0, 0.0
        self._slices = deque([Sketch()], maxlen=_SLICES + 1)

    def add(self, duration_s: float) -> None:
        """One more message passed."""
        self.count += 1
        self.total += duration_s
        self._slices[-1].add(duration_s)

    def end_slice(self) -> None:
        """A minute is over."""
        self._slices.append(Sketch())

    def parts(self) -> list[Sketch]:
        """Sketches of the last 15 minutes; none of them changes any more."""
        *whole, newest = self._slices
        return [*whole, merged([newest])]


# --- messages at their hops -----------------------------------------------------------

REMEMBERED: Final = 2048
"""A minute of 30 messages a second: FIWARE that is later is down, not late."""


class Stream:
    """One kind of data of one robot, followed from tap to tap by its count.

    The robot's own message at the broker and Orion's notification are two copies of one
    message; (boot, seq) says which belong together.

    Attributes:
        segments: Durations, by hop.
        decided_at: When the newest was decided on (monotonic, s); None: never.
    """

    def __init__(self, robot_id: str, data: Data, clock: ClockOffset) -> None:
        self.robot_id, self.data, self.clock = robot_id, data, clock
        self.segments: dict[Segment, Series] = {hop: Series() for hop in SEGMENTS}
        self.decided_at: float | None = None
        self._boot: str | None = None
        self._stamps: dict[Segment, float] = {}
        self._copies: dict[int, tuple[float, float | None] | None] = {}
        """By ``seq``, oldest first: its moment at the broker (monotonic, s) and its Δt₁
        (s), while Orion's copy is still to come; None after that."""

    def read_from_broker(
        self, origin: Origin, at: Instant, composed_at: float | None
    ) -> None:
        """Our own reading of the broker has it."""
        seq = self._follow(origin)
        # Where Orion's copy was first, nobody knows when it was at the broker.
        if seq in self._copies:
            return
        took = self._transit("uplink", origin, at, composed_at)
        if seq is not None:
            self._remember(seq, (at.mono, took))

    def notified(self, origin: Origin, at: Instant, composed_at: float | None) -> None:
        """Orion has notified it."""
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
        """It arrived then and has just been decided on (``now`` monotonic, s)."""
        self.segments["iveg"].add(now - at.mono)
        self.decided_at = now

    def _follow(self, origin: Origin) -> int | None:
        """Its place in the count; None where it names none.  A new boot begins anew."""
        if origin.boot is None or origin.seq is None:
            return None
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
        """Time from the robot's stamp (s); None where it does not count."""
        if origin.stamp_s is None or origin.stamp_s == self._stamps.get(hop):
            return None
        self._stamps[hop] = origin.stamp_s
        took = self.clock.time_message(origin.stamp_s, at, composed_at)
        if took is not None:
            self.segments[hop].add(took)
        return took


class LatencyWatch:
    """Latency of the whole fleet: the calls that boundaries make for each message.

    A call costs a few microseconds (``benchmarks/latency_cost.py``), so that every
    message of twenty robots can be timed.

    Args:
        robots: Ids of the fleet.
        composed_at: When a feedback of ours was composed (monotonic, s); None unknown.
    """

    def __init__(
        self, robots: Iterable[str], composed_at: Callable[..., float | None]
    ) -> None:
        self._composed_at = composed_at
        self.clocks = {robot_id: ClockOffset() for robot_id in robots}
        self._streams = {
            (robot_id, data): Stream(robot_id, data, clock)
            for robot_id, clock in self.clocks.items()
            for data in DATA
        }
        self._slice_at: float | None = None

    @property
    def streams(self) -> list[Stream]:
        """All of them, robot by robot."""
        return list(self._streams.values())

    def arrived(self, received: Received) -> None:
        """A copy came in, on either transport."""
        stream = self._stream(received)
        if stream is None:
            return
        origin = received.observation.origin
        composed_at = self._composed_at(*origin.echoes)
        is_fiware = received.transport == FIWARE.id
        tap = stream.notified if is_fiware else stream.read_from_broker
        tap(origin, received.at, composed_at)

    def decided(self, taken: Iterable[Received], now: Instant) -> None:
        """These became part of the state, and the fleet has been judged with them."""
        for received in taken:
            stream = self._stream(received)
            if stream is not None:
                stream.decided(received.at, now.mono)

    def decided_at(self, robot_id: str, data: Data) -> float | None:
        """When the newest was decided on (monotonic, s); None: never."""
        stream = self._streams.get((robot_id, data))
        return None if stream is None else stream.decided_at

    def painted(
        self, robot_id: str, data: Data, decided_at: float, painted_at: float
    ) -> None:
        """A page has drawn what was decided on then (monotonic, s, the server's)."""
        took = painted_at - decided_at
        stream = self._streams.get((robot_id, data))
        if stream is not None and 0.0 <= took <= LONGEST_S:
            stream.segments["screen"].add(took)

    def tick(self, now: Instant) -> None:
        """Let time pass, slice by slice."""
        if self._slice_at is None:
            self._slice_at = now.mono
        if now.mono - self._slice_at < SLICE_S:
            return
        self._slice_at = now.mono
        for stream in self._streams.values():
            for series in stream.segments.values():
                series.end_slice()

    def _stream(self, received: Received) -> Stream | None:
        data = data_of(kind_of(received.observation))
        if data is None or received.asked:
            return None
        return self._streams.get((received.observation.robot_id, data))


# --- the table ------------------------------------------------------------------------

Cell = tuple[Data, Segment]


def collect(
    streams: Iterable[Stream], robot_id: str | None = None
) -> dict[Cell, list[Sketch]]:
    """The sketches of one robot or of all; for the loop."""
    found: dict[Cell, list[Sketch]] = {
        (data, hop): [] for data in DATA for hop in SEGMENTS
    }
    for stream in streams:
        if robot_id in (None, stream.robot_id):
            for hop, series in stream.segments.items():
                found[stream.data, hop] += series.parts()
    return found


def merge(parts: Mapping[Cell, list[Sketch]]) -> dict[Cell, Sketch]:
    """One sketch a cell; for any thread."""
    return {cell: merged(sketches) for cell, sketches in parts.items()}


Place = Literal["simulation", "field"]


@dataclass(frozen=True, slots=True)
class PaperLatency:
    """One row of the paper's table, all in ms; a total at P95 is a sum of two P95."""

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
