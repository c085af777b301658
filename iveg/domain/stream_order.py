"""Order of the messages of one robot (docs/interfaces/mqtt.md).

The newest wins: no message waits for a late one, and no stamp ever decides which is
newer.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.observations import Origin

OrderVerdict = Literal["new", "late", "duplicate", "refused"]
"""``refused``: it calls itself a replay, and its robot is live."""

_REMEMBERED_SEQS = 512
"""Copies of the last ten seconds and more, at 30 Hz, are known for copies."""
_REMEMBERED_BOOTS = 16
_GROWN_TO_RETURN = 5
_LEAP = 100_000
"""No count goes on so far unheard: it is an hour of 30 messages a second."""


@dataclass(slots=True)
class StreamOrder:
    """The position of one stream (robot and kind).

    A straggler of an unknown boot looks like a new start, and would make the present
    boot an old one for ever.  So an old boot that goes on counting, five times with no
    message of the present one in between, becomes the present one again.  One wrong
    number would make all true ones late, too: a count that leaps is believed likewise.
    """

    boot: str | None = None
    seq: int = -1
    _old: dict[str, int] = field(default_factory=dict)
    _returning: str | None = None
    _grown: int = 0
    _leapt_to: int | None = None
    _leapt: int = 0
    _recent: deque[int] = field(default_factory=deque)
    _known: set[int] = field(default_factory=set)
    """The same, to look them up: what FIWARE brings is a copy nearly always."""

    def knows_better_than(self, origin: Origin) -> bool:
        """Whether a record is of an earlier boot and must not be judged."""
        return self.boot is not None and origin.boot != self.boot

    def is_past(self, boot: str, seq: int) -> bool:
        """Whether :meth:`judge` will never call this message new."""
        return boot == self.boot and seq <= self.seq

    def is_twin(self, boot: str, seq: int) -> bool:
        """Whether :meth:`judge` will call this message a duplicate."""
        return boot == self.boot and seq in self._known

    def judge(self, origin: Origin) -> OrderVerdict:
        """Judge whether a message is newer than all before, and remember it.

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
        if origin.seq - self.seq > _LEAP and not self._goes_on(origin.seq):
            return "late"
        self._leapt_to = None
        if origin.seq in self._known:
            return "duplicate"
        self._remember(origin.seq)
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

    def _goes_on(self, seq: int) -> bool:
        """Whether a count that leapt has gone on from there."""
        known, self._leapt_to = self._leapt_to, seq
        near = known is not None and 0 < seq - known <= _LEAP
        self._leapt = self._leapt + 1 if near else 1
        return self._leapt >= _GROWN_TO_RETURN

    def _begin(self, boot: str, seq: int) -> None:
        self._old.pop(boot, None)
        if self.boot is not None:
            self._old[self.boot] = self.seq
        while len(self._old) > _REMEMBERED_BOOTS:
            del self._old[next(iter(self._old))]
        self.boot, self.seq, self._returning = boot, seq, None
        self._recent.clear()
        self._known.clear()
        self._remember(seq)

    def _remember(self, seq: int) -> None:
        self._recent.append(seq)
        self._known.add(seq)
        if len(self._recent) > _REMEMBERED_SEQS:
            self._known.discard(self._recent.popleft())
