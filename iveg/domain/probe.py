"""Lag of the FIWARE data path, measured by iVeg's own heartbeat probes alone.

A probe goes out every two seconds and comes back through broker, agent and Orion.  The
newest returned probe gives the time of the path then.  The oldest probe that is still
out gives a lower bound for now, so that a stopped path does not look fast::

    sent    1    2    3    4    5
    back    +1.0 +1.5                →  now, 4 s after 3 left: 4.0 s behind

A probe no longer counts once a later probe is back: it may be lost for ever.

``Hop`` names the hops of the path for both judges.  The health monitor judges them by
the probe that passes them all, ``iveg doctor`` by using each once.
"""

from collections import deque
from dataclasses import dataclass, field
from enum import StrEnum

from iveg.domain.observations import Instant, Origin


class Hop(StrEnum):
    """Hops, in the order in which a datum passes them.

    The value is the id in JSON, metrics, errors and translations.
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
"""Number of remembered probes: those of twenty minutes."""
SLOW_S = 1.0
"""Time above which a probe, a measure or an answer is late (s)."""


@dataclass(slots=True)
class ProbeLag:
    """Matches returned probes with the times at which they left.

    All times are those of iVeg's own monotonic clock; a probe carries none.
    """

    _sent: dict[Origin, float] = field(default_factory=dict)
    _out: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _newest: float = float("-inf")
    _transit_s: float | None = None

    def sent(self, origin: Origin, now: Instant) -> None:
        """Note a probe that leaves."""
        self._sent[_count(origin)] = now.mono
        self._out.append(now.mono)
        if len(self._sent) > _KEPT:
            del self._sent[next(iter(self._sent))]

    def returned(self, origin: Origin, now: Instant) -> None:
        """Note a returned probe; a probe of an earlier run is ignored."""
        sent_at = self.sent_at(origin)
        # A probe behind a later probe shows a lag that is over.
        if sent_at is None or sent_at <= self._newest:
            return
        self._newest = sent_at
        while self._out and self._out[0] <= sent_at:
            self._out.popleft()
        self._transit_s = now.mono - sent_at

    def sent_at(self, origin: Origin) -> float | None:
        """Departure of a probe (monotonic, s); None for a probe of another run."""
        return self._sent.get(_count(origin))

    @property
    def is_known(self) -> bool:
        """Whether a probe has come back; until then ``lag`` is a lower bound."""
        return self._transit_s is not None

    def has_passed(self, sent_at: float) -> bool:
        """Whether a probe of ``sent_at`` (monotonic, s) or a later one came back."""
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
    """Sentence for a lag (s), for the log, programs and ``iveg doctor``."""
    late = f"{lag_s:.0f}" if lag_s >= 10.0 else f"{lag_s:.1f}"
    return f"measures reach Orion {late} s late"


def stopped_in_words(lag_s: float | None) -> str:
    """Sentence for a stopped path, with the lag where known (s)."""
    for_s = "" if lag_s is None else f", for {lag_s:.0f} s by now"
    return f"measures do not reach Orion{for_s}"


def _count(origin: Origin) -> Origin:
    """Identity of a probe."""
    # FIWARE may print a stamp in another form, so stamps are left out.
    return Origin(origin.boot, origin.seq)
