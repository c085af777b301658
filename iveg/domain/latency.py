"""Where the milliseconds go: each message timed at each hop that it passed.

::

    robot's stamp ──Δt₁──> broker ──Δt₂──> Orion ──Δt₃──> decision ──Δt₄──> painted
                   uplink          fiware          iveg            screen
                  └────────── robot_orion ────────┘

The paper tabulates Δt₁ (robot to MQTT broker) and Δt₂ (broker to IoT Agent to Orion),
section "Temporal determinism"; Δt₃ and Δt₄ go on from there to the eye.  ``watch`` is
what the doors call, ``stream`` follows one kind of data of one robot, ``offset`` says
how far its clock can be believed, ``series`` and ``sketch`` keep what was measured in
bounded room.

Names of the latency table: segments of the data path, data, windows.

A segment lies between two places where a message is timed; JSON and columns call it
``hop`` (``domain.hops`` has what is judged healthy or not).

Many durations in little room: counts by logarithmic bins, quantiles within 1 %.

The bins are DDSketch's (Masson, Rim, Lee: VLDB 2019).  A sketch that is finished never
changes: it may be merged in another thread while the next one fills.

One hop's durations over time: ten-second slices become minutes become hours.

::

    added ──> buffer ──10 s──> slice ──60 s──> minute ──60 min──> hour
              at most 512      7 kept          15 kept            24 kept

Each step merges finished sketches, so that a window of a day is read from at most 24
hours, 60 minutes and 6 slices, and never from its messages.

How far a robot's clock is from ours, with its uncertainty: proven, not guessed.

A message was measured after the feedback that its robot had heard was composed (F), and
before it arrived (R).  Its stamp S therefore bounds the offset θ = robot − server::

    S − R  <=  θ  <=  S − F          each message, R and F on the server's clock

The narrowest bounds of the last one to two minutes count.  A clock that they do not
disprove is taken to be in step, as clocks are that follow NTP: from one side a delay on
the way up and a clock that is behind look alike (docs/safety.md, "Age"), and the bounds
say how wrong that may be.  Where they rule zero out, the middle counts, if they are
narrow.

::

    contradicts the bounds ──> unused until five agree ──> new bounds: it was set

One kind of data of one robot, followed from tap to tap by its count.

The robot's own reading of the broker and Orion's notification are two copies of one
message; (boot, seq) says which belong together.  A ring of the newest 2,048 remembers
when each was seen, so that matching costs an index and no search.

Latency of the whole fleet: the calls that boundaries make for each message.

A call costs a few microseconds (``benchmarks/latency_cost.py``), so that every message
of twenty robots with ninety messages a second can be timed: nothing is allocated for a
message, it gets its place in a ring.

What the latency page tells: each hop of each kind of data over one window.

Collecting is quick and belongs to the loop, since streams live there; merging needs
finished sketches alone and may be done in any thread.

The two tables that the paper printed, to stand beside what is measured here.

Both are of a real FIWARE with MongoDB: the first in simulation on a local network
("co-located LAN deployment"), the second in the AgroConnect greenhouse (n > 10,000 for
Δt₁, n = 598 for Δt₂).  Its totals at P95 are sums of two P95, not a P95 of sums.
"""

from array import array
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isnan, nan
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

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

Window = Literal["1min", "15min", "24h"]
WINDOW_S: Final[dict[Window, float]] = {"1min": 60.0, "15min": 900.0, "24h": 86400.0}

STAMP_S: Final = 0.001
"""Resolution of a stamp (s): what lies below zero by less is zero."""
LONGEST_S: Final = 60.0
"""A longer time is not counted: the stamp is wrong, or the message was replayed."""

_DATA: Final[dict[type, Data]] = {
    Odometry: "odometry",
    DetectionFrame: "detections",
    LaserScan: "lidar",
}


def data_of(kind: type[Observation]) -> Data | None:
    """The row of the table that a kind of observation belongs to; None for no row."""
    return _DATA.get(kind)


ACCURACY: Final = 0.01
"""A quantile is off by this share of itself at most."""
_SHORTEST_S, _LONGEST_S = 1e-6, 600.0
"""What is shorter or longer counts as these, which bounds the bins to 1,012."""
_GAMMA: Final = (1.0 + ACCURACY) / (1.0 - ACCURACY)
_LOG_GAMMA: Final = float(np.log(_GAMMA))


@dataclass(frozen=True)
class Sketch:
    """Durations of one hop over some time.

    Attributes:
        count: How many were measured.
        total: Their sum (s); ``least`` and ``most`` (s), all exact.
        keys: Shape (n,): bins that are not empty, rising.
        counts: Shape (n,): how many fell into each.
    """

    count: int = 0
    total: float = 0.0
    least: float = float("inf")
    most: float = 0.0
    keys: NDArray[np.int16] = field(default_factory=lambda: np.empty(0, np.int16))
    counts: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))

    @property
    def mean(self) -> float | None:
        """(s); None of nothing."""
        return self.total / self.count if self.count else None

    def quantile(self, share: float) -> float | None:
        """The quantile of a share (0 to 1) (s), within 1 %; None without data."""
        if not self.count:
            return None
        rank = share * (self.count - 1)
        place = np.searchsorted(np.cumsum(self.counts), rank, side="right")
        value: float = 2.0 * _GAMMA ** float(self.keys[place]) / (1.0 + _GAMMA)
        return min(max(value, self.least), self.most)

    def distribution(self) -> tuple[list[float], list[float]]:
        """Rising durations (s), and the share (0 to 1) that did not exceed each."""
        edges = np.minimum(np.exp(self.keys * _LOG_GAMMA), self.most)
        shares = np.cumsum(self.counts) / max(1, self.count)
        return edges.tolist(), shares.tolist()


NOTHING: Final = Sketch()


def sketch_of(durations: Sequence[float]) -> Sketch:
    """Durations (s, not below zero) as a sketch."""
    if not durations:
        return NOTHING
    values = np.asarray(durations, np.float64)
    inside = np.clip(values, _SHORTEST_S, _LONGEST_S)
    keys, counts = np.unique(
        np.ceil(np.log(inside) / _LOG_GAMMA).astype(np.int16), return_counts=True
    )
    return Sketch(
        values.size,
        float(values.sum()),
        float(values.min()),
        float(values.max()),
        keys,
        counts.astype(np.int64),
    )


def merged(sketches: Iterable[Sketch]) -> Sketch:
    """All of them as one: as if their durations had gone into it."""
    parts = [one for one in sketches if one.count]
    if len(parts) < 2:
        return parts[0] if parts else NOTHING
    keys, places = np.unique(
        np.concatenate([one.keys for one in parts]), return_inverse=True
    )
    weights = np.concatenate([one.counts for one in parts])
    return Sketch(
        sum(one.count for one in parts),
        sum(one.total for one in parts),
        min(one.least for one in parts),
        max(one.most for one in parts),
        keys,
        np.bincount(places, weights).astype(np.int64),
    )


SLICE_S: Final = 10.0
SLICES_A_MINUTE: Final = 6
SLICES_AN_HOUR: Final = 360
_BUFFER: Final = 512


class Series:
    """Latency of one hop, for one kind of data of one robot."""

    __slots__ = (
        "_buffer",
        "_folded",
        "_hour",
        "_hours",
        "_minute",
        "_minutes",
        "_slices",
        "count",
        "total",
    )

    def __init__(self) -> None:
        self._buffer: list[float] = []
        self._folded: list[Sketch] = []
        self._slices: deque[Sketch] = deque(maxlen=SLICES_A_MINUTE)
        self._minute: list[Sketch] = []
        self._minutes: deque[Sketch] = deque(maxlen=15)
        self._hour: list[Sketch] = []
        self._hours: deque[Sketch] = deque(maxlen=24)
        self.count = 0
        """How many there were since the start; ``total`` their sum (s)."""
        self.total = 0.0

    def add(self, duration_s: float) -> None:
        """One more message passed."""
        self.count += 1
        self.total += duration_s
        self._buffer.append(duration_s)
        if len(self._buffer) >= _BUFFER:
            self._fold()

    def end_slice(self, count: int) -> None:
        """A slice is over, the ``count``-th of all (from 1)."""
        self._fold()
        ended = merged(self._folded)
        self._folded = []
        self._slices.append(ended)
        self._minute.append(ended)
        if count % SLICES_A_MINUTE:
            return
        minute = merged(self._minute)
        self._minute = []
        self._minutes.append(minute)
        self._hour.append(minute)
        if count % SLICES_AN_HOUR == 0:
            self._hours.append(merged(self._hour))
            self._hour = []

    def parts(self, window: Window) -> list[Sketch]:
        """Finished sketches that together are this window, to be merged."""
        self._fold()
        now = list(self._folded)
        if window == "1min":
            return [*self._slices, *now]
        if window == "15min":
            return [*self._minutes, *self._minute, *now]
        return [*self._hours, *self._hour, *self._minute, *now]

    def _fold(self) -> None:
        if self._buffer:
            self._folded.append(sketch_of(self._buffer))
            self._buffer = []


AGREE: Final = 5
TRUSTED_S: Final = 0.1
"""Half the width of bounds (s) that an offset other than zero may have."""
_WINDOW_S: Final = 60.0
_TOLERANCE_S: Final = 0.02
"""Stamps are rounded and clocks are slewed: by less no clock was set."""
_SAME_S: Final = 0.5
_INF: Final = float("inf")

State = Literal["in_step", "assumed", "corrected", "untrusted", "unknown"]
"""``assumed``: nothing disproves it, and nothing bounds it from above, because the
robot does not echo."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """The offset lies between these (s)."""

    low: float = -_INF
    high: float = _INF

    def within(self, other: "Bounds") -> "Bounds":
        """Intersection of both bounds; empty (low > high) if they contradict."""
        return Bounds(max(self.low, other.low), min(self.high, other.high))


_ANYTHING: Final = Bounds()


class ClockOffset:
    """The known offset of one robot's clock.

    Attributes:
        bounds: What the last one to two minutes prove.
        state: How far the clock can be believed.
        offset_s: Robot's clock less ours (s), as it is used; None where not trusted.
        jumps: How often it was set while iVeg looked.
    """

    def __init__(self) -> None:
        self.bounds = self._older = self._newer = _ANYTHING
        self.state: State = "unknown"
        self.offset_s: float | None = None
        self.jumps = 0
        self._since = -_INF
        self._suspects: list[Bounds] = []

    def time_message(
        self, stamp_s: float, at: Instant, composed_at: float | None
    ) -> float | None:
        """Take one message; returns its transit (s), or None where nothing tells it.

        Args:
            stamp_s: By the robot's clock (Unix s).
            at: When it arrived.
            composed_at: When the feedback that it had heard was composed, on our
                monotonic clock (s); None where it echoes nothing.
        """
        low = stamp_s - at.wall
        if composed_at is None and low < -LONGEST_S:
            self.state, self.offset_s = "untrusted", None
            return None
        high = _INF if composed_at is None else low + max(0.0, at.mono - composed_at)
        if self._is_jump(low, high):
            self._suspect(Bounds(low, high), at.mono)
            return None
        if self._suspects or self.offset_s is None or self._tells_more(low, high, at):
            self._suspects.clear()
            self._note(Bounds(low, high), at.mono)
        if self.offset_s is None:
            return None
        took = self.offset_s - low
        if took < -STAMP_S:
            return None
        return max(0.0, took)

    @property
    def uncertainty_s(self) -> float | None:
        """Greatest error of ``offset_s`` (s); None where nothing bounds it."""
        offset, bounds = self.offset_s, self.bounds
        if offset is None or bounds.high == _INF:
            return None
        return max(0.0, offset - bounds.low, bounds.high - offset)

    def _is_jump(self, low: float, high: float) -> bool:
        known = self.bounds
        if low > known.high + _TOLERANCE_S or high < known.low - _TOLERANCE_S:
            return True
        # Nothing bounds it from above: a leap into the future shows itself by its size.
        return (
            known.high == _INF
            and known.low > -_INF
            and low > max(0.0, known.low) + _SAME_S
        )

    def _suspect(self, bounds: Bounds, now: float) -> None:
        if self._suspects and abs(bounds.low - self._suspects[0].low) > _SAME_S:
            self._suspects.clear()
        self._suspects.append(bounds)
        if len(self._suspects) >= AGREE:
            agreed = _ANYTHING
            for one in self._suspects:
                agreed = agreed.within(one)
            self._suspects.clear()
            self.jumps += 1
            self._older, self._newer, self._since = _ANYTHING, agreed, now
            self._settle()

    def _tells_more(self, low: float, high: float, at: Instant) -> bool:
        newer = self._newer
        is_due = at.mono - self._since >= _WINDOW_S
        return is_due or low > newer.low or high < newer.high

    def _note(self, bounds: Bounds, now: float) -> None:
        if now - self._since >= _WINDOW_S:
            self._older, self._newer, self._since = self._newer, bounds, now
        else:
            self._newer = self._newer.within(bounds)
        both = self._older.within(self._newer)
        if both.low > both.high:
            # Slewed by a few milliseconds: the newest message is right.
            self._older, self._newer = _ANYTHING, bounds
        self._settle()

    def _settle(self) -> None:
        """Derive offset and uncertainty from the bounds."""
        bounds = self.bounds = self._older.within(self._newer)
        if bounds.low <= STAMP_S and bounds.high >= -STAMP_S:
            self.state = "assumed" if bounds.high == _INF else "in_step"
            self.offset_s = 0.0
        elif (bounds.high - bounds.low) / 2 <= TRUSTED_S:
            self.state, self.offset_s = "corrected", (bounds.low + bounds.high) / 2
        else:
            self.state, self.offset_s = "untrusted", None


RING: Final = 2048
"""A minute of 30 messages a second: FIWARE that is later is down, not late."""
_MASK = RING - 1


class Stream:
    """Measurements of one kind of data of one robot.

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
        self._seqs = array("q", [-1]) * RING
        self._seen_at = array("d", [0.0]) * RING
        self._took = array("d", [nan]) * RING
        self._waits = bytearray(RING)
        """Whether Orion's copy is still to come."""

    def heard(self, origin: Origin, at: Instant, composed_at: float | None) -> None:
        """Our own reading of the broker has it."""
        seq = self._follow(origin)
        if seq is None:
            self._transit("uplink", origin, at, composed_at)
            return
        place = seq & _MASK
        if self._seqs[place] == seq:
            # Of what Orion's copy outran nobody knows when it was at the broker, so
            # nothing says how the way of that copy divides.
            return
        took = self._transit("uplink", origin, at, composed_at)
        self._seqs[place], self._seen_at[place] = seq, at.mono
        self._took[place], self._waits[place] = took, True

    def notified(self, origin: Origin, at: Instant, composed_at: float | None) -> None:
        """Orion has notified it."""
        seq = self._follow(origin)
        if seq is None:
            self._transit("robot_orion", origin, at, composed_at)
            return
        place = seq & _MASK
        if self._seqs[place] != seq:
            self._transit("robot_orion", origin, at, composed_at)
            self._seqs[place], self._waits[place] = seq, False
        elif self._waits[place]:
            self._waits[place] = False
            took = at.mono - self._seen_at[place]
            self.segments["fiware"].add(took)
            if not isnan(self._took[place]):
                self.segments["robot_orion"].add(self._took[place] + took)

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
            self._seqs = array("q", [-1]) * RING
        return origin.seq

    def _transit(
        self, hop: Segment, origin: Origin, at: Instant, composed_at: float | None
    ) -> float:
        """What it took from the robot's stamp (s); ``nan`` where it does not count."""
        if origin.stamp_s is None or origin.stamp_s == self._stamps.get(hop):
            return nan
        self._stamps[hop] = origin.stamp_s
        took = self.clock.time_message(origin.stamp_s, at, composed_at)
        if took is None:
            return nan
        self.segments[hop].add(took)
        return took


_SERIES_A_TICK: Final = 40
"""So many end their slice in one tick: the others wait for the next (0.05 s)."""
_MOST_ROBOTS: Final = 256


class LatencyWatch:
    """Times messages at their hops.

    Args:
        composed_at: When a feedback of ours was composed (monotonic, s); None unknown.
    """

    def __init__(
        self,
        robots: Iterable[str] = (),
        composed_at: Callable[..., float | None] = lambda *_: None,
    ) -> None:
        self._composed_at = composed_at
        self._streams: dict[tuple[str, Data], Stream] = {}
        self.clocks: dict[str, ClockOffset] = {}
        self._slice_at: float | None = None
        self._slices = 0
        self._ending: Iterator[Series] = iter(())
        for robot_id in robots:
            self._add(robot_id)

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
        tap = stream.notified if is_fiware else stream.heard
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
        """Let time pass: slices for the windows."""
        for _, series in zip(range(_SERIES_A_TICK), self._ending, strict=False):
            series.end_slice(self._slices)
        if self._slice_at is None:
            self._slice_at = now.mono
        elif now.mono - self._slice_at >= SLICE_S:
            self._slice_at = now.mono
            self._slices += 1
            all_series = [one.segments.values() for one in self.streams]
            self._ending = iter([one for of in all_series for one in of])

    def _stream(self, received: Received) -> Stream | None:
        data = data_of(kind_of(received.observation))
        if data is None or received.asked:
            return None
        robot_id: str = received.observation.robot_id
        stream = self._streams.get((robot_id, data))
        if stream is None and len(self.clocks) < _MOST_ROBOTS:
            self._add(robot_id)
            stream = self._streams[robot_id, data]
        return stream

    def _add(self, robot_id: str) -> None:
        clock = self.clocks[robot_id] = ClockOffset()
        for data in DATA:
            self._streams[robot_id, data] = Stream(robot_id, data, clock)


Cell = tuple[Data, Segment]


def collect(
    streams: Iterable[Stream], window: Window, robot_id: str | None = None
) -> dict[Cell, list[Sketch]]:
    """The finished sketches of a window, of one robot or of all; for the loop."""
    found: dict[Cell, list[Sketch]] = {
        (data, hop): [] for data in DATA for hop in SEGMENTS
    }
    for stream in streams:
        if robot_id in (None, stream.robot_id):
            for hop, series in stream.segments.items():
                found[stream.data, hop] += series.parts(window)
    return found


def merge(parts: Mapping[Cell, list[Sketch]]) -> dict[Cell, Sketch]:
    """One sketch a cell; for any thread."""
    return {cell: merged(sketches) for cell, sketches in parts.items()}


Place = Literal["simulation", "field"]


@dataclass(frozen=True, slots=True)
class PaperLatency:
    """One row, all in ms."""

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
