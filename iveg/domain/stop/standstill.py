"""Standing still, measured: what safety reports show and odometry does not contradict.

Five samples at rest over at least a second, none more than half a second after the
one before; a moving wheel in the last half second contradicts them (safety.md §2.3).
"""

from iveg.domain.observations import Instant

STANDING_SAMPLES, STANDING_S, STANDING_FRESH_S = 5, 1.0, 0.5
"""So many samples at rest, over so long, none later than this after the one before."""
MOVED_SAMPLES = 3


class Standstill:
    """Counts samples at rest and samples that move.

    Attributes:
        since: The first sample of the present rest.
    """

    def __init__(self) -> None:
        self.since: Instant | None = None
        self._count = 0
        self._newest = float("-inf")
        self._moving_samples = 0
        self._moved_at = float("-inf")

    def forget(self) -> None:
        """What was measured does not count any more."""
        self.since, self._count = None, 0

    def rested(self, at: Instant) -> bool:
        """One more report at rest; whether the rest is a standstill."""
        if at.mono - self._newest > STANDING_FRESH_S:
            # Nobody knows what it did in the gap.
            self.forget()
        if self.since is None:
            self.since = at
        self._newest = at.mono
        self._count += 1
        long_enough = at.mono - self.since.mono >= STANDING_S
        contradicted = at.mono - self._moved_at < STANDING_FRESH_S
        return self._count >= STANDING_SAMPLES and long_enough and not contradicted

    def odometry(self, at: Instant, *, moves: bool) -> bool:
        """One sample of odometry; whether several in a row have moved."""
        self._moving_samples = self._moving_samples + 1 if moves else 0
        if moves:
            self._moved_at = at.mono
        return self._moving_samples >= MOVED_SAMPLES
