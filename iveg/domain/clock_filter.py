"""The fastest message of the last minute, of one transport and one boot.

::

    stamps fall while seq rises, or  ──> unknown until five    ──> a new filter
    a message beats the fastest by       messages agree            begins
    more than half a second
"""

from collections import deque
from dataclasses import dataclass, field

from iveg.domain.observations import Origin

_BUCKET_S, _BUCKETS = 5.0, 12
STEP_S = 0.5
"""A clock that leaps by less is corrected within a minute, unnoticed."""
AGREE = 5
"""So many messages of one transport and boot must agree before a leap is believed."""

Kind = type
Place = tuple[int | None, float]


@dataclass(slots=True)
class ClockFilter:
    """The fastest message of the last minute, of one transport and one boot."""

    _buckets: deque[tuple[float, float]] = field(
        default_factory=lambda: deque(maxlen=_BUCKETS)
    )
    _newest: dict[Kind, Place] = field(default_factory=dict)
    _suspects: list[float] = field(default_factory=list)
    _suspected_by: Kind | None = None
    seen_at: float = float("-inf")
    least: float | None = None
    """Arrival less stamp of the fastest message (s); None before the first."""
    newest: float | None = None
    """The same of the newest one."""

    def observe(self, kind: Kind, origin: Origin, now: float) -> float | None:
        """Take one message in; ``kind`` says whose count its ``seq`` belongs to.

        Returns:
            What it took beyond the fastest one (s), 0 without a stamp; None while
            nobody can say, because its clock seems to have been set.
        """
        if origin.stamp_s is None:
            return 0.0
        transit, self.seen_at = now - origin.stamp_s, now
        self.newest = transit
        is_next, fell = self._place(kind, origin.seq, origin.stamp_s)
        least = self.least
        if least is None:
            self._note(now, transit)
            return 0.0
        leaps = transit < least - STEP_S or (fell and transit > least + STEP_S)
        if leaps or self._is_suspect(transit):
            return self._suspect(kind, transit, now)
        if is_next and kind is self._suspected_by:
            # The very sender is back where it was: one stamp was wrong.
            self._forget_suspects()
        self._note(now, transit)
        return max(0.0, transit - least)

    def _place(self, kind: Kind, seq: int | None, stamp_s: float) -> tuple[bool, bool]:
        """Whether it is the newest of its kind, and its stamp fell all the same."""
        before, last = self._newest.get(kind, (None, float("-inf")))
        if seq is not None and before is not None and seq <= before:
            return False, False
        self._newest[kind] = seq, stamp_s
        return True, stamp_s < last - STEP_S

    def _is_suspect(self, transit: float) -> bool:
        return bool(self._suspects) and abs(transit - self._suspects[0]) <= STEP_S

    def _suspect(self, kind: Kind, transit: float, now: float) -> float | None:
        """One more message of a clock that was set, or only seems to have been."""
        if not self._is_suspect(transit):
            self._forget_suspects()
        if not self._suspects:
            self._suspected_by = kind
        self._suspects.append(transit)
        if len(self._suspects) < AGREE:
            return None
        least = min(self._suspects)
        self._buckets.clear()
        self._forget_suspects()
        self._note(now, least)
        return transit - least

    def _forget_suspects(self) -> None:
        self._suspects.clear()
        self._suspected_by = None

    def _note(self, now: float, transit: float) -> None:
        buckets = self._buckets
        if not buckets or now - buckets[-1][0] > _BUCKET_S:
            buckets.append((now, transit))
        elif transit < buckets[-1][1]:
            buckets[-1] = (buckets[-1][0], transit)
        else:
            return
        self.least = min(transit for _, transit in buckets)
