"""Order of the messages of one robot (docs/interfaces/mqtt.md).

The newest wins: no message waits for a late one, and no stamp ever decides which is
newer.
"""

from collections import deque
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from iveg.domain.observations import Origin

OrderVerdict = Literal["new", "late", "duplicate", "refused"]
"""``refused``: it calls itself a replay, and its robot is live."""

_REMEMBERED_SEQS = 512
"""Copies of the last ten seconds and more, at 30 Hz, are known for copies."""
_REMEMBERED_BOOTS = 16
ALONE_S = 1.0
"""An old boot that alone speaks for so long is the present one again."""
_ROUNDING_S = 1e-6


@dataclass(slots=True)
class PresentBoot:
    """The present boot of a robot, by the feedback that its messages echo.

    A boot has heard no feedback from before its start.  So a message that echoes older
    feedback than the first that a later boot echoed is of an earlier boot.
    """

    _boot: str | None = None
    _since: float = -inf
    """The first feedback that it echoed was composed then (monotonic, s)."""
    _met: deque[str | None] = field(
        default_factory=lambda: deque(maxlen=_REMEMBERED_BOOTS)
    )

    def meet(self, boot: str | None, proven_at: float) -> None:
        """Note that this boot has heard feedback that was composed then."""
        if boot in self._met:
            return
        self._met.append(boot)
        if proven_at > self._since:
            self._boot, self._since = boot, proven_at

    def is_past(self, boot: str | None, proven_at: float | None) -> bool:
        """Whether a message is of an earlier boot; unproven, of any but the present."""
        if proven_at is None:
            return bool(self._met) and boot != self._boot
        return proven_at < self._since - _ROUNDING_S


@dataclass(slots=True)
class StreamOrder:
    """The position of one stream (robot and kind).

    A straggler of an unknown boot looks like a new start, and would make the present
    boot an old one for ever.  So an old boot that goes on counting for a second, with
    no message of the present one in between, becomes the present one again; and at once
    when it has heard feedback from after the straggler, which itself proves nothing.
    """

    boot: str | None = None
    seq: int = -1
    _began: float = inf
    """Arrival of the boot's first message (monotonic, s)."""
    _is_proven: bool = False
    _old: dict[str, int] = field(default_factory=dict)
    _returning: tuple[str, float] | None = None
    """The old boot that speaks alone, and since when (monotonic, s)."""
    _known: dict[int, None] = field(default_factory=dict)
    """The last counts in the order of arrival: FIWARE brings copies nearly always."""

    def knows_better_than(self, origin: Origin) -> bool:
        """Whether a record is of an earlier boot and must not be judged."""
        return self.boot is not None and origin.boot != self.boot

    def judge(
        self, origin: Origin, arrived: float = 0.0, proven_at: float | None = None
    ) -> OrderVerdict:
        """Judge whether a message is newer than all before, and remember it.

        A message without identity is new by arrival.  It ``arrived`` then, and the
        feedback that it echoes was composed at ``proven_at`` (monotonic, s); None where
        that proves nothing.
        """
        boot, seq = origin.boot, origin.seq
        if boot is None or seq is None:
            return "new"
        if boot != self.boot:
            if boot in self._old and not self._returns(origin, arrived, proven_at):
                return "late"
            self._begin(boot, seq, arrived, is_proven=proven_at is not None)
            return "new"
        self._returning = None
        self._is_proven |= proven_at is not None
        if seq in self._known:
            return "duplicate"
        self._remember(seq)
        if seq <= self.seq:
            return "late"
        self.seq = seq
        return "new"

    def _returns(self, origin: Origin, arrived: float, proven_at: float | None) -> bool:
        """Whether an old boot lives: it echoes that, or goes on counting alone."""
        boot, seq = origin.boot or "", origin.seq or 0
        if seq <= self._old[boot]:
            return False
        self._old[boot] = seq
        if proven_at is not None and proven_at > self._began and not self._is_proven:
            return True
        if self._returning is None or self._returning[0] != boot:
            self._returning = boot, arrived
        return arrived - self._returning[1] >= ALONE_S

    def _begin(self, boot: str, seq: int, arrived: float, *, is_proven: bool) -> None:
        self._old.pop(boot, None)
        if self.boot is not None:
            self._old[self.boot] = self.seq
        while len(self._old) > _REMEMBERED_BOOTS:
            del self._old[next(iter(self._old))]
        self.boot, self.seq, self._returning = boot, seq, None
        self._began, self._is_proven = arrived, is_proven
        self._known.clear()
        self._remember(seq)

    def _remember(self, seq: int) -> None:
        self._known[seq] = None
        if len(self._known) > _REMEMBERED_SEQS:
            del self._known[next(iter(self._known))]
