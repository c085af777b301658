"""Order and clocks of what one robot sends (safety.md §3.1, §3.2).

Newest wins: nothing waits for a message that is late.  A robot's stamp says how long a
message travelled, relative to its fastest one; it never decides which is newer.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.observations import Instant, Origin

Verdict = Literal["new", "late", "duplicate"]

_REMEMBERED_SEQS = 128
_REMEMBERED_BOOTS = 16
_GROWN_TO_RETURN = 5
_BUCKET_S, _BUCKETS = 5.0, 12
_JUMP_S = 10.0
"""No message travels that much longer than another: the clock was set (fault F16)."""


@dataclass(slots=True)
class Order:
    """Where one stream (robot and kind) stands.

    A straggler of a boot that was never seen looks like a new start, and would make
    the living boot an old one for ever.  So an old boot that goes on counting, five
    times with no word of the present one in between, is taken for what it is.
    """

    boot: str | None = None
    seq: int = -1
    _old: dict[str, int] = field(default_factory=dict)
    _returning: str | None = None
    _grown: int = 0
    _recent: deque[int] = field(default_factory=lambda: deque(maxlen=_REMEMBERED_SEQS))

    def knows_better_than(self, origin: Origin) -> bool:
        """Whether an old record must not even be judged: it is of another boot."""
        return self.boot is not None and origin.boot != self.boot

    def judge(self, origin: Origin) -> Verdict:
        """Say whether a message is newer than all before, and remember it.

        A message without identity is new by arrival.
        """
        if origin.boot is None or origin.seq is None:
            return "new"
        if origin.boot != self.boot:
            if origin.boot in self._old and not self._returns(origin.boot, origin.seq):
                return "late"
            self._begin(origin.boot, origin.seq)
            return "new"
        self._returning = None
        if origin.seq in self._recent:
            return "duplicate"
        self._recent.append(origin.seq)
        if origin.seq <= self.seq:
            return "late"
        self.seq = origin.seq
        return "new"

    def _returns(self, boot: str, seq: int) -> bool:
        """Whether an old boot has gone on counting while the present one was silent."""
        if seq <= self._old[boot]:
            return False
        self._old[boot] = seq
        if boot != self._returning:
            self._returning, self._grown = boot, 0
        self._grown += 1
        return self._grown >= _GROWN_TO_RETURN

    def _begin(self, boot: str, seq: int) -> None:
        self._old.pop(boot, None)
        if self.boot is not None:
            self._old[self.boot] = self.seq
        while len(self._old) > _REMEMBERED_BOOTS:
            del self._old[next(iter(self._old))]
        self.boot, self.seq, self._returning = boot, seq, None
        self._recent.clear()
        self._recent.append(seq)


@dataclass(slots=True)
class ClockEstimate:
    """Offset of a robot's clock against ours, by the fastest message of a minute.

    The minimum of (arrival - stamp) over 60 s is the offset plus the shortest path
    delay; what a message took beyond it is its own delay (the min-filter of NTP).
    """

    _buckets: deque[tuple[float, float]] = field(
        default_factory=lambda: deque(maxlen=_BUCKETS)
    )

    def observe(self, origin: Origin, at: Instant) -> float:
        """Take one message in; return its extra delay (s), 0 without a stamp."""
        if origin.stamp_s is None:
            return 0.0
        transit = at.wall - origin.stamp_s
        if self._buckets and abs(transit - self._least()) > _JUMP_S:
            self._buckets.clear()
        if not self._buckets or at.mono - self._buckets[-1][0] > _BUCKET_S:
            self._buckets.append((at.mono, transit))
        elif transit < self._buckets[-1][1]:
            self._buckets[-1] = (self._buckets[-1][0], transit)
        return max(0.0, transit - self._least())

    def _least(self) -> float:
        return min(transit for _, transit in self._buckets)

    @property
    def offset_s(self) -> float | None:
        """How far the robot's clock is behind ours (s); None without stamps."""
        return self._least() if self._buckets else None
