"""One kind of data of one robot, followed from tap to tap by its count.

The robot's own reading of the broker and Orion's notification are two copies of one
message; (boot, seq) says which belong together.  A ring of the newest 2,048 remembers
when each was seen, so that matching costs an index and no search.
"""

from array import array
from collections import Counter, deque
from dataclasses import dataclass
from math import isnan, nan
from typing import Final

from iveg.domain.latency.offset import ClockOffset
from iveg.domain.latency.segments import SEGMENTS, Data, Exclusion, Segment
from iveg.domain.latency.sequence_loss import SequenceLoss
from iveg.domain.latency.series import Series
from iveg.domain.latency.trace import Tracer
from iveg.domain.observations import Instant, Origin

RING: Final = 2048
"""A minute of 30 messages a second: FIWARE that is later is down, not late."""
_MASK = RING - 1
_FREE, _AGENT, _DENSE, _BOTH, _ORION_FIRST = range(5)
_RATE_S: Final = 5


@dataclass(frozen=True, slots=True)
class StreamRates:
    """Messages a second over the last five.

    Attributes:
        heard: That reached the broker, as iVeg read them.
        agent: Of these, on the agent's topic; the rest the robot kept from it.
        orion: That Orion notified.
    """

    heard: float
    agent: float
    orion: float


class Stream:
    """Measurements of one kind of data of one robot.

    Attributes:
        hops: Durations, by hop.
        excluded: Messages that are in no statistics, by hop and reason.
        up: Order of arrival at the broker; ``fiware`` at Orion.
        is_throttled: Orion was told to leave most of it out: Δt₂ is a sample.
        orion_first: How often Orion's copy was here before our reading of the broker:
            these have a total, and neither Δt₁ nor Δt₂.
        decided_at: When the newest was decided on (monotonic, s); None: never.
    """

    def __init__(self, robot_id: str, data: Data, clock: ClockOffset) -> None:
        self.robot_id, self.data, self.clock = robot_id, data, clock
        self.segments: dict[Segment, Series] = {hop: Series() for hop in SEGMENTS}
        self.excluded: Counter[tuple[Segment, Exclusion]] = Counter()
        self.up, self.fiware = SequenceLoss(), SequenceLoss()
        self.tracer = Tracer()
        self.is_throttled = False
        self.orion_first = 0
        self.decided_at: float | None = None
        self._boot: str | None = None
        self._stamps: dict[Segment, float] = {}
        self._seqs = array("q", [-1]) * RING
        self._seen_at = array("d", [0.0]) * RING
        self._took = array("d", [nan]) * RING
        self._state = bytearray(RING)
        self._heard = self._by_agent = self._by_orion = 0
        self._past: deque[tuple[int, int, int]] = deque(maxlen=_RATE_S + 1)

    # --- taps -----------------------------------------------------------------------

    def heard(
        self, origin: Origin, at: Instant, composed_at: float | None, *, agent: bool
    ) -> None:
        """Our own reading of the broker has it; ``agent``: on the agent's topic."""
        self._heard += 1
        self._by_agent += agent
        seq = self._follow(origin)
        if seq is None:
            self._transit("uplink", origin, at, composed_at)
            return
        place = seq & _MASK
        if self._seqs[place] == seq and self._state[place] != _ORION_FIRST:
            self.up.repeated += 1
            return
        self.up.count(seq)
        if self._seqs[place] == seq:
            # When it was at the broker is not known, so nothing says how the way of
            # Orion's copy, which is measured, divides.
            self.orion_first += 1
            self._state[place] = _BOTH
            return
        took = self._transit("uplink", origin, at, composed_at)
        self._put(place, seq, at.mono, took, _AGENT if agent else _DENSE)
        self.tracer.heard(seq, origin.stamp, took, at.mono)

    def passed_over(self, count: int) -> None:
        """So many were at the broker, and newer ones with them: none is lost."""
        self._heard += count
        self.up.unread += count
        self.up.skipped += count

    def notified(
        self, origin: Origin, at: Instant, composed_at: float | None, *, thinned: bool
    ) -> None:
        """Orion has notified it; ``thinned``: it was told to leave most of them out."""
        self._by_orion += 1
        self.is_throttled = thinned
        seq = self._follow(origin)
        if seq is None:
            self._transit("robot_orion", origin, at, composed_at)
            return
        place = seq & _MASK
        state = self._state[place] if self._seqs[place] == seq else _FREE
        if state in (_BOTH, _ORION_FIRST):
            self.fiware.repeated += 1
            return
        self._count_missing(seq, thinned=thinned)
        if state == _FREE:
            took = self._transit("robot_orion", origin, at, composed_at)
            self._put(place, seq, at.mono, took, _ORION_FIRST)
            self.tracer.heard(seq, origin.stamp, took, at.mono)
            self.tracer.notified(seq, at.mono)
            return
        self._state[place] = _BOTH
        took = at.mono - self._seen_at[place]
        self.segments["fiware"].add(took, at.mono)
        if not isnan(self._took[place]):
            self.segments["robot_orion"].add(self._took[place] + took, at.mono)
        self.tracer.notified(seq, at.mono)

    def decided(self, origin: Origin, at: Instant, now: float) -> None:
        """It arrived then and has just been decided on (``now`` monotonic, s)."""
        self.segments["iveg"].add(now - at.mono, now)
        self.decided_at = now
        self.tracer.decided(origin.seq, now)

    def painted(self, took_s: float, now: float) -> None:
        """A page has drawn it so long after the decision (s)."""
        self.segments["screen"].add(took_s, now)
        self.tracer.painted(now)

    # --- what can be read off ---------------------------------------------------------

    def waiting_s(self, now: float) -> float | None:
        """How long the oldest that Orion has not notified has waited (s); None: none.

        A message that a later one passed waits no more: it is counted as missing.
        """
        newest, heard = self.fiware.newest, self.up.newest
        if newest is None or heard is None or self.is_throttled:
            return None
        for seq in range(max(newest, heard - RING) + 1, heard + 1):
            place = seq & _MASK
            if self._seqs[place] == seq and self._state[place] == _AGENT:
                return now - self._seen_at[place]
        return None

    def second(self) -> None:
        """A second has passed."""
        self._past.append((self._heard, self._by_agent, self._by_orion))
        self.up.second()
        self.fiware.second()

    @property
    def rates(self) -> StreamRates:
        """The rates that really arrive."""
        if len(self._past) < 2:
            return StreamRates(0.0, 0.0, 0.0)
        (h0, a0, o0), (h1, a1, o1) = self._past[0], self._past[-1]
        for_s = len(self._past) - 1
        return StreamRates((h1 - h0) / for_s, (a1 - a0) / for_s, (o1 - o0) / for_s)

    # --- the ring ---------------------------------------------------------------------

    def _follow(self, origin: Origin) -> int | None:
        """Its place in the count; None where it names none.  A new boot begins anew."""
        if origin.boot is None or origin.seq is None:
            return None
        if origin.boot != self._boot:
            self._boot = origin.boot
            self._state = bytearray(RING)
            self._seqs = array("q", [-1]) * RING
            self.up.restart()
            self.fiware.restart()
        return origin.seq

    def _put(self, place: int, seq: int, at: float, took: float, state: int) -> None:
        self._seqs[place], self._seen_at[place] = seq, at
        self._took[place], self._state[place] = took, state

    def _transit(
        self, hop: Segment, origin: Origin, at: Instant, composed_at: float | None
    ) -> float:
        """What it took from the robot's stamp (s); ``nan`` where it does not count."""
        if origin.stamp_s is None:
            return self._exclude(hop, "no_stamp")
        if origin.stamp_s == self._stamps.get(hop):
            return self._exclude(hop, "repeated_stamp")
        self._stamps[hop] = origin.stamp_s
        took = self.clock.time_message(origin.stamp_s, at, composed_at)
        if isinstance(took, str):
            return self._exclude(hop, took)
        self.segments[hop].add(took, at.mono)
        return took

    def _exclude(self, hop: Segment, why: Exclusion) -> float:
        self.excluded[hop, why] += 1
        return nan

    def _count_missing(self, seq: int, *, thinned: bool) -> None:
        """What went to the agent before this one and has not come by now."""
        newest = self.fiware.newest
        if thinned or newest is None or seq <= newest:
            self.fiware.arrived(seq)
            return
        passed = range(max(newest, seq - RING) + 1, seq)
        missing = sum(
            self._seqs[one & _MASK] == one and self._state[one & _MASK] == _AGENT
            for one in passed
        )
        self.fiware.arrived(seq, missing)
