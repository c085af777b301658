"""Lag of the FIWARE data path, measured by iVeg's own heartbeat probes alone.

A probe goes out every two seconds and comes back through broker, agent and Orion.  The
newest that came back says how long the path took then; the oldest that is still out
says how long it takes at least now, so that a path that stops is not taken for a fast
one::

    sent    1    2    3    4    5
    back    +1.0 +1.5                →  now, 4 s after 3 left: 4.0 s behind

A probe that a later one has overtaken no longer counts: it may be lost for ever.

The hops of the data path.

One vocabulary for both judges: the running health monitor judges hops by the heartbeat
probe that passes them all, ``iveg doctor`` by using each once.
"""

from collections import deque
from dataclasses import dataclass, field
from enum import StrEnum

from iveg.domain.observations import Instant, Origin


class Hop(StrEnum):
    """One hop, in the order in which a datum passes them.

    The value is its id in JSON, metrics, errors and translations.
    """

    MQTT = "mqtt"
    AGENT = "iot_agent"
    ORION = "orion"
    NOTIFICATIONS = "notifications"
    DATABASE = "database"
    PAGE = "server"

    @property
    def label(self) -> str:
        """Key of its name in the translations."""
        return f"hop.{self.value}"


_KEPT = 600
"""Probes remembered: twenty minutes of them, at one in two seconds."""
SLOW_S = 1.0
"""A probe, a measure or an answer that takes longer is late (s)."""


@dataclass(slots=True)
class ProbeLag:
    """Matches probes that come back with the moments when they left.

    All moments are iVeg's own monotonic clock; what a probe carries is never a time.
    """

    _sent: dict[Origin, float] = field(default_factory=dict)
    _out: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _newest: float = float("-inf")
    _transit_s: float | None = None

    def sent(self, origin: Origin, now: Instant) -> None:
        """A probe leaves."""
        self._sent[_count(origin)] = now.mono
        self._out.append(now.mono)
        if len(self._sent) > _KEPT:
            del self._sent[next(iter(self._sent))]

    def returned(self, origin: Origin, now: Instant) -> None:
        """A probe has come back; one of an earlier life of iVeg proves nothing."""
        left = self.sent_at(origin)
        if left is None or left <= self._newest:
            return
        self._newest = left
        while self._out and self._out[0] <= left:
            self._out.popleft()
        self._transit_s = now.mono - left

    def sent_at(self, origin: Origin) -> float | None:
        """When this probe left (monotonic, s); None for one that is not ours."""
        return self._sent.get(_count(origin))

    @property
    def is_known(self) -> bool:
        """Whether a probe has come back; until then ``lag`` only says "at least"."""
        return self._transit_s is not None

    def has_passed(self, sent_at: float) -> bool:
        """Whether a probe that left then (monotonic, s), or a later one, came back."""
        return sent_at <= self._newest

    @property
    def transit_s(self) -> float:
        """Transit time of the newest returned probe (s); 0 before the first."""
        return self._transit_s or 0.0

    def lag(self, now: Instant) -> float | None:
        """Lag of the data path (s); None before the first probe left."""
        known = [] if self._transit_s is None else [self._transit_s]
        if self._out:
            known.append(max(0.0, now.mono - self._out[0]))
        return max(known, default=None)


def lag_in_words(lag_s: float) -> str:
    """A lag as the log, programs and ``iveg doctor`` say it."""
    late = f"{lag_s:.0f}" if lag_s >= 10.0 else f"{lag_s:.1f}"
    return f"measures reach Orion {late} s late"


def stopped_in_words(lag_s: float | None) -> str:
    """Sentence that nothing passes, and for how long where a probe tells (s)."""
    for_s = "" if lag_s is None else f", for {lag_s:.0f} s by now"
    return f"measures do not reach Orion{for_s}"


def _count(origin: Origin) -> Origin:
    """Identity of a probe; stamps may be reprinted on the way."""
    return Origin(origin.boot, origin.seq)
