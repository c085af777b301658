"""Order of the messages of one robot (docs/interfaces/mqtt.md).

The newest message wins: no message waits for a late one, and no stamp decides.
"""

from collections import deque
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from iveg.domain.observations import Origin

Freshness = Literal["new", "late", "duplicate", "refused", "stored"]
"""Place of a message in its stream.

``refused``: a replay of a robot that is live.  ``stored``: Orion's answer to a query
that is newer than all that is known: it is shown, but is no news and proves nothing.
"""

_REMEMBERED_SEQS = 512
"""Counts in which a copy is recognised: more than ten seconds of them at 30 Hz."""
_REMEMBERED_BOOTS = 16
ALONE_S = 1.0
"""Time after which an old boot that speaks alone is the present one again (s)."""
_ROUNDING_S = 1e-6


@dataclass(slots=True)
class PresentBoot:
    """The present boot of a robot, by the feedback that its messages echo.

    A boot has received no feedback from before its start.  So a message is of an
    earlier boot if it echoes older feedback than the first that a later boot echoed.

    Attributes:
        _since: Composition of the first feedback that it echoed (monotonic, s).
    """

    _boot: str | None = None
    _since: float = -inf
    _known_boots: deque[str | None] = field(
        default_factory=lambda: deque(maxlen=_REMEMBERED_BOOTS)
    )

    def meet(self, boot: str | None, proven_at: float) -> None:
        """Note that a boot echoes feedback that was composed at ``proven_at``."""
        # Only its first echo bounds its start.
        if boot in self._known_boots:
            return
        self._known_boots.append(boot)
        if proven_at > self._since:
            self._boot, self._since = boot, proven_at

    def is_past(self, boot: str | None, proven_at: float | None) -> bool:
        """Whether a message is of an earlier boot; unproven: of any other boot."""
        if proven_at is None:
            return bool(self._known_boots) and boot != self._boot
        return proven_at < self._since - _ROUNDING_S


@dataclass(slots=True)
class StreamOrder:
    """The position of one stream (robot and kind).

    A straggler of an unknown boot looks like a new start, and would make the present
    boot an old one for ever.  So an old boot becomes the present one again if it counts
    on for a second without a message of the present boot in between, or at once if it
    echoes feedback from after a straggler without a proof.

    Attributes:
        boot: Present boot; ``seq``: its newest count.
        _began: Arrival of the boot's first message (monotonic, s).
        _is_proven: Whether a message of this boot has echoed our feedback.
        _old_boots: Old boot → its newest count.
        _returning: The old boot that speaks alone, and since when (monotonic, s).
        _recent: Last counts as they arrived: FIWARE nearly always brings copies.
    """

    boot: str | None = None
    seq: int = -1
    _began: float = inf
    _is_proven: bool = False
    _old_boots: dict[str, int] = field(default_factory=dict)
    _returning: tuple[str, float] | None = None
    _recent: dict[int, None] = field(default_factory=dict)

    def is_of_other_boot(self, origin: Origin) -> bool:
        """Whether a message is of another boot than the present one of this stream."""
        return self.boot is not None and origin.boot != self.boot

    def knows(self, boot: object, seq: object) -> bool:
        """Whether a message of the present boot was judged before."""
        return type(seq) is int and boot == self.boot and seq in self._recent

    def judge(
        self, origin: Origin, arrived: float, proven_at: float | None = None
    ) -> Freshness:
        """Judge whether a message is newer than all before, and remember it.

        Args:
            origin: Boot and count of the message; without both it is new by arrival.
            arrived: Time of arrival (monotonic, s).
            proven_at: When the feedback that it echoes was composed (monotonic, s);
                None: it proves nothing.
        """
        boot, seq = origin.boot, origin.seq
        if boot is None or seq is None:
            return "new"
        if boot != self.boot:
            if boot in self._old_boots and not self._returns(
                origin, arrived, proven_at
            ):
                return "late"
            self._begin(boot, seq, arrived, is_proven=proven_at is not None)
            return "new"
        self._returning = None
        self._is_proven |= proven_at is not None
        if seq in self._recent:
            return "duplicate"
        self._remember(seq)
        if seq <= self.seq:
            return "late"
        self.seq = seq
        return "new"

    def _returns(self, origin: Origin, arrived: float, proven_at: float | None) -> bool:
        """Whether an old boot is alive: its echo proves it, or it counts on alone."""
        boot, seq = origin.boot or "", origin.seq or 0
        if seq <= self._old_boots[boot]:
            return False
        self._old_boots[boot] = seq
        # It received feedback after the straggler came, so it outlived that message.
        if proven_at is not None and proven_at > self._began and not self._is_proven:
            return True
        if self._returning is None or self._returning[0] != boot:
            self._returning = boot, arrived
        return arrived - self._returning[1] >= ALONE_S

    def _begin(self, boot: str, seq: int, arrived: float, *, is_proven: bool) -> None:
        self._old_boots.pop(boot, None)
        if self.boot is not None:
            self._old_boots[self.boot] = self.seq
        # Bounded, since any client of the broker can name new boots.
        while len(self._old_boots) > _REMEMBERED_BOOTS:
            del self._old_boots[next(iter(self._old_boots))]
        self.boot, self.seq, self._returning = boot, seq, None
        self._began, self._is_proven = arrived, is_proven
        self._recent.clear()
        self._remember(seq)

    def _remember(self, seq: int) -> None:
        self._recent[seq] = None
        if len(self._recent) > _REMEMBERED_SEQS:
            del self._recent[next(iter(self._recent))]
