"""The probability that somebody is a person, from all looks of one robot at them.

A detector that is 0.72 sure in every picture never reaches a threshold of 0.80, and is
right nearly every time.  So its looks add up (naive Bayes, even prior)::

    log-odds = Σ logit(confidence of a look)        P = 1 / (1 + e^−log-odds)

A detector's mistake lasts from picture to picture, so the pictures of 0.3 s are one
look, which counts by the surest of them.  A confidence below 0.50 is no look.  Time
without a look counts against a suspicion, and a second of it ends it.  None of this
lifts anything: a ring that is drawn goes by time or by an all-clear.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant

FAINT_FROM = 0.50
LOOK_S = 0.3
_SLACK_S = 0.01
"""Pictures at 10 or 30 Hz are a multiple of it apart, nearly."""
_FORGOTTEN_S = 1.0
_MISS = 1.0
"""Log-odds that 0.3 s without a look cost."""
_SUREST = 4.0
"""Bound of the log-odds: no number of looks makes certain (0.982)."""
_NEAR_M = 1.0
MOST_SUSPECTS = 64
"""Of each robot; the one not seen for longest gives way."""


@dataclass(frozen=True, slots=True)
class Looks:
    """What is known of one suspected person.

    Attributes:
        count: Number of looks; ``least`` and ``most`` sure of them (0 to 1).
        over_s: From the first to the newest (s).
        probability: That it is a person (0 to 1).
    """

    count: int
    least: float
    most: float
    over_s: float
    probability: float

    def reach(self, threshold: float) -> bool:
        """Whether they are enough together; one look alone is a box like any other."""
        return self.count > 1 and self.probability >= threshold


@dataclass(frozen=True, slots=True)
class FaintPerson:
    """A detection that may be a person: where in ``map`` (m), and how sure."""

    x: float
    y: float
    confidence: float


@dataclass(slots=True)
class _Suspect:
    """One suspicion; moments are monotonic seconds.

    Attributes:
        odds: Log-odds of the looks that are over, and of their absence.
        look: Confidence of the look that goes on since ``look_at``.
        judged_at: Until when their absence has been counted.
    """

    x: float
    y: float
    look: float
    first_at: float
    look_at: float
    seen_at: float
    judged_at: float
    odds: float = 0.0
    count: int = 1
    least: float = 1.0
    most: float = 0.0

    def see(self, one: FaintPerson, now: float) -> None:
        """It was seen again, or for the first time."""
        self.x, self.y, self.seen_at = one.x, one.y, max(self.seen_at, now)
        self.judged_at = self.seen_at
        self.least = min(self.least, one.confidence)
        self.most = max(self.most, one.confidence)
        if now - self.look_at < LOOK_S - _SLACK_S:
            self.look = max(self.look, one.confidence)
            return
        self.odds = self._log_odds
        self.look, self.look_at = one.confidence, now
        self.count += 1

    def miss(self, now: float) -> None:
        """It was not in a picture."""
        if now - self.judged_at >= LOOK_S - _SLACK_S:
            self.odds -= _MISS
            self.judged_at = now

    def is_over(self, now: float) -> bool:
        """Whether nothing is left of it."""
        return now - self.seen_at > _FORGOTTEN_S or self._log_odds < 0.0

    def reaches(self, one: FaintPerson, now: float) -> float | None:
        """How far from it a detection is (m); None: too far to be the same."""
        apart = math.hypot(one.x - self.x, one.y - self.y)
        walked = LIMITS.walking_m_s * abs(now - self.seen_at)
        return apart if apart <= _NEAR_M + walked else None

    @property
    def _log_odds(self) -> float:
        return min(_SUREST, self.odds + _logit(self.look))

    @property
    def looks(self) -> Looks:
        """As it stands."""
        return Looks(
            self.count,
            self.least,
            self.most,
            round(self.seen_at - self.first_at, 3),
            1.0 / (1.0 + math.exp(-self._log_odds)),
        )


@dataclass(slots=True)
class Suspicions:
    """Everybody whom robots suspect, each from its own pictures alone."""

    _of: dict[str, list[_Suspect]] = field(default_factory=dict)

    def look(
        self, observer: str, seen: Sequence[FaintPerson], at: Instant
    ) -> list[Looks]:
        """Take one picture of a robot: what is known of each who is in it."""
        now = at.mono
        known = _kept(self._of.get(observer, ()), now)
        free = list(known)
        found = [_match(one, free, known, now) for one in seen]
        for suspect in free:
            suspect.miss(now)
        self._of[observer] = _kept(known, now)
        return [suspect.looks for suspect in found]


def _match(
    one: FaintPerson, free: list[_Suspect], known: list[_Suspect], now: float
) -> _Suspect:
    """The nearest suspect within reach that the picture has not shown yet, or a new."""
    near = [(far, number) for number, far in _within(one, free, now)]
    if near:
        suspect = free.pop(min(near)[1])
    else:
        suspect = _Suspect(one.x, one.y, one.confidence, now, now, now, now)
        known.append(suspect)
    suspect.see(one, now)
    return suspect


def _within(
    one: FaintPerson, free: Sequence[_Suspect], now: float
) -> Iterator[tuple[int, float]]:
    for number, suspect in enumerate(free):
        far = suspect.reaches(one, now)
        if far is not None:
            yield number, far


def _kept(known: Sequence[_Suspect], now: float) -> list[_Suspect]:
    going_on = [one for one in known if not one.is_over(now)]
    return sorted(going_on, key=lambda one: one.seen_at)[-MOST_SUSPECTS:]


def _logit(probability: float) -> float:
    bounded = min(max(probability, 0.01), 0.99)
    return math.log(bounded / (1.0 - bounded))
