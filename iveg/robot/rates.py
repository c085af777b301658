"""Rates of telemetry that a robot sends through the IoT Agent.

One agent carries about 150 measures a second; two robots at 30 Hz send 180.  iVeg
reports Orion's backlog, and a robot that learns of one sends less, scans first::

    level  0 ───────────── 1 ───────────── 2 ───────────── 3
    scans  all ──> 1 Hz    1 Hz            1 Hz            1 Hz
    camera all             all ──> 3 Hz    3 Hz            3 Hz
    poses  all             all             all ──> 5 Hz    5 Hz

The level rises while the backlog lasts and falls slowly afterwards; after each fall
that was too early the next one waits twice as long.  No reported backlog can raise a
rate above the sensor's own or lower it below these floors.  Safety reports are
never fewer, nor are the single payloads of Algorithm 1, which hold all in one message.
Messages held back still go to iVeg directly.
"""

from dataclasses import dataclass, field
from operator import itemgetter

from iveg.domain.kinds import MEASURED

TOP_HZ = 30.0
FLOOR_HZ = dict(
    sorted(
        ((one.suffix or "", one.floor_hz) for one in MEASURED if one.floor_hz),
        key=itemgetter(1),
    )
)
"""Least rates by device; who can be rarest gives way first."""
LEVELS = float(len(FLOOR_HZ))

BEHIND_S, WELL_S = 0.5, 0.25
"""Lag (s) that counts as a backlog, and as none; between the two the level stays."""
FAR_BEHIND_S = 3.0
RISE_PER_S, RISE_FAR_PER_S, SINK_PER_S = 0.5, 1.0, 0.02
PATIENCE_S, LONGEST_PATIENCE_S = 10.0, 600.0
_LONGEST_STEP_S = 0.5


@dataclass(slots=True)
class UplinkRates:
    """Decides which message is a measure; every other is sent to iVeg alone.

    All moments are monotonic (s).

    Attributes:
        level: 0: every message is a measure; 3: all rates are at their floors.
    """

    level: float = 0.0
    _told_at: float | None = None
    _well_since: float | None = None
    _patience_s: float = PATIENCE_S
    _sank: bool = False
    _due: dict[str, float] = field(default_factory=dict)

    def note_backlog(self, backlog_s: float | None, now: float) -> None:
        """Take Orion's reported lag; None, when unknown, changes nothing."""
        before, self._told_at = self._told_at, now
        if backlog_s is None or before is None:
            return
        step = min(max(0.0, now - before), _LONGEST_STEP_S)
        if backlog_s >= BEHIND_S:
            self._rise(backlog_s, step)
        elif backlog_s > WELL_S:
            self._well_since = None
        else:
            self._sink(now, step)

    def _rise(self, backlog_s: float, step: float) -> None:
        if self._sank:
            self._patience_s = min(2.0 * self._patience_s, LONGEST_PATIENCE_S)
        self._sank, self._well_since = False, None
        speed = RISE_FAR_PER_S if backlog_s >= FAR_BEHIND_S else RISE_PER_S
        self.level = min(LEVELS, self.level + speed * step)

    def _sink(self, now: float, step: float) -> None:
        if self._well_since is None:
            self._well_since = now
        if self.level == 0.0:
            self._sank, self._patience_s = False, PATIENCE_S
        elif now - self._well_since >= self._patience_s:
            self._sank = True
            self.level = max(0.0, self.level - SINK_PER_S * step)

    def is_measure(self, suffix: str, now: float, *, news: bool = False) -> bool:
        """Whether a device's message also goes to the agent; changes always do."""
        interval = self._interval_s(suffix)
        due = self._due.get(suffix, now)
        if now < due and not news:
            return False
        # A late message is compensated, so that the mean rate is kept, not exceeded.
        self._due[suffix] = max(due, now - interval) + interval
        return True

    def _interval_s(self, suffix: str) -> float:
        """Least time between two measures of a device (s); 0: every message is one."""
        if self.level == 0.0:
            return 0.0
        for place, (device, floor_hz) in enumerate(FLOOR_HZ.items()):
            # From the sensor's own rate (0) to its floor (1).
            share = min(1.0, self.level - place)
            if device == suffix and share > 0.0:
                return float((TOP_HZ / floor_hz) ** share / TOP_HZ)
        return 0.0
