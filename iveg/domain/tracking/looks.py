"""Probability that somebody is a person, from all looks at them.

A detector that is 0.72 sure in every picture never reaches a threshold of 0.80, and is
right nearly every time.  So its looks add up (naive Bayes, even prior)::

    log-odds = Σ log-odds of a look                 P = 1 / (1 + e^−log-odds)
    log-odds of a look = logit(confidence)

A detector's mistake lasts from picture to picture, so the pictures of 0.3 s are one
look, which counts by the surest of them.  A confidence below 0.50 is no look.  Each
robot's looks count for themselves.  Time without a look counts against a suspicion, and
a second of it ends it::

    suspected ── looks or one box reach the threshold ──> confirmed
        └── odds below even, or 1 s unseen ──> over <── 1 s unseen ──┘

Any box of 0.25 or more in each second keeps a confirmed suspect (as ByteTrack keeps a
track), and misses count no more.  Looks lift nothing: a zone ends by time or by its own
camera.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant

FAINT_FROM = 0.50
KEPT_FROM = 0.25
"""Least confidence that keeps a confirmed suspect; detectors commonly cut here."""
LOOK_S = 0.3
_SLACK_S = 0.01
"""Tolerance of a look's length: pictures at 10 or 30 Hz come a little early (s)."""
FORGOTTEN_S = 1.0
_MISS = 1.0
"""Log-odds that 0.3 s without a look cost."""
SUREST = 4.0
"""Bound of the log-odds: no number of looks makes certain (0.982)."""
_NEAR_M = 1.0
MOST_SUSPECTS = 64
"""Suspects of each robot; the one not seen for longest gives way."""


def logit(probability: float) -> float:
    """Log-odds, of at least 0.01 and at most 0.99."""
    bounded = min(max(probability, 0.01), 0.99)
    return math.log(bounded / (1.0 - bounded))


@dataclass(frozen=True, slots=True)
class Looks:
    """All looks of a robot at one suspected person.

    Attributes:
        count: Number of looks.
        least: Least confidence of a look (0 to 1); ``most``: the greatest.
        over_s: Time from the first look to the newest (s).
        probability: Probability that it is a person (0 to 1).
        confirmed: Whether these looks, or a box among them, reached the threshold.
    """

    count: int
    least: float
    most: float
    over_s: float
    probability: float
    confirmed: bool = False


@dataclass(frozen=True, slots=True)
class FaintPerson:
    """A detection that may be a person: place in ``map`` (m), confidence (0 to 1)."""

    x: float
    y: float
    confidence: float


@dataclass(slots=True)
class _Suspect:
    """One suspicion; moments are monotonic seconds.

    Attributes:
        odds: Log-odds of the looks that are over, and of their absence.
        look: Log-odds of the look that goes on since ``look_at``.
        judged_at: Moment up to which their absence has been counted.
    """

    x: float
    y: float
    look: float
    first_at: float
    look_at: float
    seen_at: float
    judged_at: float
    odds: float = 0.0
    confirmed: bool = False
    count: int = 1
    least: float = 1.0
    most: float = 0.0

    def see(self, box: FaintPerson, now: float) -> None:
        """Add a box of a picture, to the look that goes on or as a new look."""
        self.x, self.y, self.seen_at = box.x, box.y, max(self.seen_at, now)
        self.judged_at = self.seen_at
        # A fainter box keeps the suspect and proves nothing.
        if box.confidence < FAINT_FROM:
            return
        self.least = min(self.least, box.confidence)
        self.most = max(self.most, box.confidence)
        look = logit(box.confidence)
        if now - self.look_at < LOOK_S - _SLACK_S:
            self.look = max(self.look, look)
            return
        self.odds = self.log_odds
        self.look, self.look_at = look, now
        self.count += 1

    def miss(self, now: float) -> None:
        """Count a picture that does not show it."""
        if not self.confirmed and now - self.judged_at >= LOOK_S - _SLACK_S:
            self.odds -= _MISS
            self.judged_at = now

    def is_over(self, now: float) -> bool:
        """Whether it has been unseen for too long, or is less likely than not."""
        return now - self.seen_at > FORGOTTEN_S or self.log_odds < 0.0

    def reach_m(self, now: float) -> float:
        """Distance up to which a detection may be of this suspect (m)."""
        # A late picture may be older than the newest box.
        return _NEAR_M + LIMITS.walking_m_s * abs(now - self.seen_at)

    @property
    def log_odds(self) -> float:
        """Log-odds now."""
        return min(SUREST, self.odds + self.look)


@dataclass(slots=True)
class Suspicions:
    """All suspects of all robots."""

    _by_robot: dict[str, list[_Suspect]] = field(default_factory=dict)

    def look(
        self, observer: str, seen: Sequence[FaintPerson], at: Instant, least: float
    ) -> list[Looks | None]:
        """Take one picture of a robot: its looks at each person in it.

        Args:
            observer: The robot.
            seen: Its faint persons, surest first, none below ``KEPT_FROM``.
            at: Moment of the picture.
            least: Probability from which on a person counts (0 to 1).

        Returns:
            Looks at each person; None: too faint for a suspicion, and continues none.
        """
        now = at.mono
        known = _kept(self._by_robot.get(observer, ()), now)
        unmatched = list(known)
        suspects = [_match(box, unmatched, known, now) for box in seen]
        for suspect in unmatched:
            suspect.miss(now)
        self._by_robot[observer] = _kept(known, now)
        return [
            None if suspect is None else _judged(suspect, least) for suspect in suspects
        ]


def _match(
    box: FaintPerson, unmatched: list[_Suspect], known: list[_Suspect], now: float
) -> _Suspect | None:
    """Nearest suspect in reach that the picture has not shown yet, else a new one."""
    is_look = box.confidence >= FAINT_FROM
    # A box too faint for a look continues only a suspect that is confirmed already.
    suspect = _nearest(
        box,
        [candidate for candidate in unmatched if is_look or candidate.confirmed],
        now,
    )
    if suspect is not None:
        unmatched.remove(suspect)
    elif is_look:
        suspect = _Suspect(box.x, box.y, logit(box.confidence), now, now, now, now)
        known.append(suspect)
    else:
        return None
    suspect.see(box, now)
    return suspect


def _nearest(
    box: FaintPerson, suspects: Sequence[_Suspect], now: float
) -> _Suspect | None:
    """Suspect nearest to a box; None: the box is too far from all."""
    near = [
        (distance, number)
        for number, suspect in enumerate(suspects)
        if (distance := math.hypot(box.x - suspect.x, box.y - suspect.y))
        <= suspect.reach_m(now)
        and not suspect.is_over(now)
    ]
    return suspects[min(near)[1]] if near else None


def _judged(suspect: _Suspect, least: float) -> Looks:
    """Looks at a suspect, which may confirm it."""
    probability = 1 / (1 + math.exp(-suspect.log_odds))
    # One look alone is a box like any other.
    is_enough = suspect.count > 1 and probability >= least
    suspect.confirmed |= is_enough or suspect.most >= least
    return Looks(
        suspect.count,
        suspect.least,
        suspect.most,
        round(suspect.seen_at - suspect.first_at, 3),
        probability,
        suspect.confirmed,
    )


def _kept(known: Sequence[_Suspect], now: float) -> list[_Suspect]:
    going_on = [suspect for suspect in known if not suspect.is_over(now)]
    return sorted(going_on, key=lambda suspect: suspect.seen_at)[-MOST_SUSPECTS:]
