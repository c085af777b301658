"""Upper bound of the age of a robot's message, proven by the feedback that it echoes.

Robots name in every message the newest feedback that they have received.  What was
measured after that feedback arrived was measured after it left iVeg, so the message is
at most as old as the feedback is now, on iVeg's own monotonic clock.  No clock of the
robot enters and no delay is guessed (docs/safety.md, "Age").
"""

from bisect import bisect_right

from iveg.domain.observations import FeedbackRef

_APART_S = 0.05
"""Moments closer than this share the earlier one, so that ages come out older."""
_LATELY_S = 60.0
_LONG_AGO_APART_S = 1.0
"""The same of what left iVeg longer ago than ``_LATELY_S``: whether an age is sixty
seconds or sixty-one changes nothing, and each memory of a recording holds them all."""
_KEPT_S = 900.0
_MOST = 4_000
"""Moments at which those of long ago are thinned out: 2,100 of them stay at most."""


class FeedbackLedger:
    """Remembers when each feedback message was composed."""

    def __init__(self) -> None:
        self._boot: str | None = None
        self._firsts: list[int] = []
        self._moments: list[float] = []
        self._last = -1

    def composed(self, boot: str, first: int, last: int, now: float) -> None:
        """Record that feedback ``first`` to ``last`` is composed now (monotonic, s)."""
        self._boot, self._last = boot, last
        if self._moments and now - self._moments[-1] < _APART_S:
            return
        self._firsts.append(first)
        self._moments.append(now)
        if len(self._moments) > _MOST:
            self._thin_out(now)

    def _thin_out(self, now: float) -> None:
        kept: list[tuple[int, float]] = []
        for first, moment in zip(self._firsts, self._moments, strict=True):
            is_near = bool(kept) and moment - kept[-1][1] < _LONG_AGO_APART_S
            is_spare = now - moment > _LATELY_S and is_near
            # The earliest stays, so that ages come out older.
            if now - moment <= _KEPT_S and not is_spare:
                kept.append((first, moment))
        self._firsts = [first for first, _ in kept]
        self._moments = [moment for _, moment in kept]

    def is_unsent(self, heard: FeedbackRef | None) -> bool:
        """Whether a robot names feedback of this boot that was never sent."""
        return heard is not None and heard.boot == self._boot and heard.seq > self._last

    def composed_at(self, heard: FeedbackRef | None) -> float | None:
        """The moment when that feedback was composed, or earlier (monotonic, s).

        None where nothing is proven: the feedback is of another boot of iVeg, was never
        sent, or is forgotten.
        """
        if heard is None or heard.boot != self._boot or heard.seq > self._last:
            return None
        index = bisect_right(self._firsts, heard.seq) - 1
        return None if index < 0 else self._moments[index]
