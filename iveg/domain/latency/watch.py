"""Latency of the whole fleet: the calls that boundaries make for each message.

A call costs a few microseconds (``benchmarks/latency_cost.py``), so that every message
of twenty robots with ninety messages a second can be timed: nothing is allocated for a
message, it gets its place in a ring.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Final

from iveg.domain.latency.offset import ClockOffset
from iveg.domain.latency.overloads import Overloads
from iveg.domain.latency.segments import (
    DATA,
    LONGEST_S,
    Data,
    Exclusion,
    Segment,
    data_of,
)
from iveg.domain.latency.series import SLICE_S, Series
from iveg.domain.latency.sketch import Sketch
from iveg.domain.latency.stream import Stream
from iveg.domain.observations import (
    FeedbackRef,
    Instant,
    Observation,
    Received,
    kind_of,
)
from iveg.domain.transports import FIWARE

_SECOND_S: Final = 1.0
_SERIES_A_TICK: Final = 40
"""So many end their slice in one tick: the others wait for the next (0.05 s)."""
_MOST_ROBOTS: Final = 256

Measured = tuple[str, Data, Segment, Sketch]
"""Robot, data, hop and what it took."""


class LatencyWatch:
    """Times messages at their hops.

    Args:
        composed_at: When a feedback of ours was composed (monotonic, s); None unknown.

    Attributes:
        ended: Minutes that are over, each with the wall-clock time of its beginning
            (Unix s); whoever keeps them takes them away.
        overloads: What is wrong with the hops now.
        pages_within_s: How well the page that told last knows our clock (s).
    """

    def __init__(
        self,
        robots: Iterable[str] = (),
        composed_at: Callable[[FeedbackRef | None], float | None] = lambda _: None,
    ) -> None:
        self._composed_at = composed_at
        self._streams: dict[tuple[str, Data], Stream] = {}
        self.clocks: dict[str, ClockOffset] = {}
        self.ended: list[tuple[float, Measured]] = []
        self.overloads = Overloads()
        self.pages_within_s: float | None = None
        self._second_at = self._slice_at = float("-inf")
        self._slices = 0
        self._ending: Iterator[tuple[Stream, Segment, Series]] = iter(())
        for robot_id in robots:
            self._add(robot_id)

    @property
    def streams(self) -> list[Stream]:
        """All of them, robot by robot."""
        return list(self._streams.values())

    # --- taps -----------------------------------------------------------------------

    def arrived(self, received: Received) -> None:
        """A copy came in, on either transport."""
        stream = self._stream(received)
        if stream is None:
            return
        origin = received.observation.origin
        composed_at = self._composed_at(origin.heard)
        if received.transport != FIWARE.id:
            stream.heard(origin, received.at, composed_at, agent=received.sparse)
        else:
            stream.notified(origin, received.at, composed_at, thinned=received.thinned)

    def passed_over(self, robot_id: str, kind: type[Observation], count: int) -> None:
        """So many reached the broker and were not read: newer ones came with them."""
        data = data_of(kind)
        stream = None if data is None else self._streams.get((robot_id, data))
        if stream is not None:
            stream.passed_over(count)

    def decided(self, taken: Iterable[Received], now: Instant) -> None:
        """These became part of the state, and the fleet has been judged with them."""
        for received in taken:
            stream = self._stream(received)
            if stream is not None:
                origin = received.observation.origin
                stream.decided(origin, received.at, now.mono)

    def decided_at(self, robot_id: str, data: Data) -> float | None:
        """When the newest was decided on (monotonic, s); None: never."""
        stream = self._streams.get((robot_id, data))
        return None if stream is None else stream.decided_at

    def painted(
        self, robot_id: str, data: Data, decided_at: float, painted_at: float
    ) -> None:
        """A page has drawn what was decided on then (monotonic, s, the server's)."""
        took = painted_at - decided_at
        if not 0.0 <= took <= LONGEST_S:
            self.not_painted(robot_id, data, "negative")
            return
        stream = self._streams.get((robot_id, data))
        if stream is not None:
            stream.painted(took, painted_at)

    def not_painted(self, robot_id: str, data: Data, why: Exclusion) -> None:
        """A page reported an impossible or unusable moment."""
        stream = self._streams.get((robot_id, data))
        if stream is not None:
            stream.excluded["screen", why] += 1

    # --- time -------------------------------------------------------------------------

    def tick(self, now: Instant) -> None:
        """Let time pass: seconds for what is said of now, slices for the windows."""
        self._end_some(now)
        if now.mono - self._second_at < _SECOND_S:
            return
        self._second_at = now.mono
        for stream in self._streams.values():
            stream.second()
        self.overloads.update(self.streams, now.mono)
        if now.mono - self._slice_at >= SLICE_S:
            self._begin_slice(now)

    def remember(self, hours: Iterable[Measured]) -> None:
        """What an earlier run measured within the day, by hours, oldest first."""
        for robot_id, data, hop, sketch in hours:
            stream = self._streams.get((robot_id, data))
            if stream is not None:
                stream.segments[hop].remember(sketch)

    def _begin_slice(self, now: Instant) -> None:
        is_first = self._slice_at == float("-inf")
        self._slice_at = now.mono
        if is_first:
            return
        self._slices += 1
        self._ending = iter(
            [
                (stream, hop, series)
                for stream in self._streams.values()
                for hop, series in stream.segments.items()
            ]
        )

    def _end_some(self, now: Instant) -> None:
        for _ in range(_SERIES_A_TICK):
            following = next(self._ending, None)
            if following is None:
                return
            stream, hop, series = following
            minute = series.end_slice(self._slices)
            if minute is not None and minute.count:
                measured = stream.robot_id, stream.data, hop, minute
                self.ended.append((now.wall - 60.0, measured))

    # --- streams ----------------------------------------------------------------------

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
