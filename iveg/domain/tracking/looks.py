"""The probability that somebody is a person, from all looks at them.

A detector that is 0.72 sure in every picture never reaches a threshold of 0.80, and is
right nearly every time.  So its looks add up (naive Bayes, even prior)::

    log-odds = Σ log-odds of a look                 P = 1 / (1 + e^−log-odds)
    log-odds of a look = logit(confidence) + offset of the detector's calibration

A detector's mistake lasts from picture to picture, so the pictures of 0.3 s are one
look, which counts by the surest of them.  A confidence below 0.50 is no look.  Looks of
other robots at the same place count, too.  Time without a look counts against a
suspicion, and a second of it ends it::

    suspected ── looks or one box reach the threshold ──> confirmed
        └── odds below even, or 1 s unseen ──> over <── 1 s unseen ──┘

A confirmed suspect is kept by any box of 0.25 or more in each second, however unsure
(as ByteTrack keeps a track), and misses count no more.  None of this lifts anything: a
zone that is drawn goes by time or by its own camera.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.parameters import Class

FAINT_FROM = 0.50
KEPT_FROM = 0.25
"""Where detectors commonly cut what they report."""
LOOK_S = 0.3
_SLACK_S = 0.01
"""Pictures at 10 or 30 Hz are a multiple of it apart, nearly."""
FORGOTTEN_S = 1.0
_MISS = 1.0
"""Log-odds that 0.3 s without a look cost."""
SUREST = 4.0
"""Bound of the log-odds: no number of looks makes certain (0.982)."""
_NEAR_M = 1.0
MOST_SUSPECTS = 64
"""Suspects of each robot; the one not seen for longest gives way."""


ANY = ""
"""Stands for every detector that has no row of its own."""
FARTHEST = 3.0
"""Bound of an offset: of twenty boxes one is right, or one wrong, at an even word."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """Offset of one detector and class (docs/safety.md, "Calibration").

    Two detectors that say 0.72 are not right equally often.  The offset changes what
    looks add up to, and nothing else: a box at the threshold counts as the detector
    tells it (Algorithm 2).  It is Platt's (1999) with the slope fixed at one::

        offset = log(right / wrong) - logit(mean confidence of the boxes counted)

    Attributes:
        offset: Added to the log-odds that the detector tells.
    """

    offset: float = 0.0

    @classmethod
    def of_counts(cls, right: int, wrong: int, mean: float) -> "Calibration":
        """The row of boxes that somebody compared with the truth.

        Args:
            right: So many showed what they said.
            wrong: So many did not.  Half a box is added to both (Haldane 1956), so that
                nothing is certain.
            mean: Mean confidence of all of them (0 to 1, exclusive).
        """
        offset = math.log((right + 0.5) / (wrong + 0.5)) - logit(mean)
        return cls(min(FARTHEST, max(-FARTHEST, offset)))

    def log_odds(self, confidence: float) -> float:
        """Log-odds of one look (confidence 0 to 1)."""
        return logit(confidence) + self.offset


PLAIN = Calibration()
"""The confidence as the detector tells it."""


@dataclass(frozen=True, slots=True)
class Calibrations:
    """The rows, by detector (``ANY``: the others) and class; without one: ``PLAIN``."""

    rows: Mapping[tuple[str, Class], Calibration] = field(default_factory=dict)

    def row_of(self, detector: str | None, class_: Class) -> Calibration:
        """The row for a detector's name, as its frames tell it."""
        own = self.rows.get((detector or ANY, class_))
        return own or self.rows.get((ANY, class_), PLAIN)


def logit(probability: float) -> float:
    """Log-odds, of at least 0.01 and at most 0.99."""
    bounded = min(max(probability, 0.01), 0.99)
    return math.log(bounded / (1.0 - bounded))


@dataclass(frozen=True, slots=True)
class Looks:
    """All looks at one suspected person.

    Attributes:
        count: Number of looks; ``least`` and ``most`` sure of them (0 to 1).
        over_s: From the first to the newest (s).
        probability: That it is a person (0 to 1).
        confirmed: Whether these looks, or a box among them, reached the threshold.
        lent: Whether they did only with looks of other robots.
    """

    count: int
    least: float
    most: float
    over_s: float
    probability: float
    confirmed: bool = False
    lent: bool = False


@dataclass(frozen=True, slots=True)
class FaintPerson:
    """A detection that may be a person: where in ``map`` (m), and how sure (0 to 1)."""

    x: float
    y: float
    confidence: float


@dataclass(slots=True)
class _Suspect:
    """One suspicion; moments are monotonic seconds.

    Attributes:
        odds: Log-odds of the looks that are over, and of their absence.
        look: Log-odds of the look that goes on since ``look_at``.
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
    confirmed: bool = False
    count: int = 1
    least: float = 1.0
    most: float = 0.0

    def see(self, one: FaintPerson, look: float, now: float) -> None:
        """It was seen again, or for the first time."""
        self.x, self.y, self.seen_at = one.x, one.y, max(self.seen_at, now)
        self.judged_at = self.seen_at
        if one.confidence < FAINT_FROM:
            return
        self.least = min(self.least, one.confidence)
        self.most = max(self.most, one.confidence)
        if now - self.look_at < LOOK_S - _SLACK_S:
            self.look = max(self.look, look)
            return
        self.odds = self.log_odds
        self.look, self.look_at = look, now
        self.count += 1

    def miss(self, now: float) -> None:
        """It was not in a picture."""
        if not self.confirmed and now - self.judged_at >= LOOK_S - _SLACK_S:
            self.odds -= _MISS
            self.judged_at = now

    def is_over(self, now: float) -> bool:
        """Whether nothing is left of it."""
        # As ``log_odds`` below even, asked of everybody in each picture.
        return now - self.seen_at > FORGOTTEN_S or self.odds + self.look < 0.0

    def reach_m(self, now: float) -> float:
        """Distance up to which a detection may be of the same (m)."""
        return _NEAR_M + LIMITS.walking_m_s * abs(now - self.seen_at)

    @property
    def log_odds(self) -> float:
        """Log-odds now, without other robots' looks."""
        return min(SUREST, self.odds + self.look)


@dataclass(slots=True)
class Suspicions:
    """Everybody whom robots suspect."""

    _of: dict[tuple[str | None, str], list[_Suspect]] = field(default_factory=dict)
    """Suspects by recording (None: of today) and robot."""

    def look(
        self,
        observer: str,
        seen: Sequence[FaintPerson],
        at: Instant,
        least: float,
        recording: str | None = None,
        calibration: Calibration = PLAIN,
    ) -> list[Looks | None]:
        """Take one picture of a robot: what is known of each who is in it.

        Args:
            observer: The robot.
            seen: Surest first, none below ``KEPT_FROM``.
            at: When it looked.
            least: Probability from which on a person counts (0 to 1).
            recording: Whose looks are no looks of today.
            calibration: Of the detector.

        Returns:
            None for who is too faint to be suspected and continues nobody.
        """
        now, own = at.mono, (recording, observer)
        known = _kept(self._of.get(own, ()), now)
        free = list(known)
        found = [_match(one, free, known, calibration, now) for one in seen]
        for suspect in free:
            suspect.miss(now)
        self._of[own] = _kept(known, now)
        others = [
            theirs
            for key, theirs in self._of.items()
            if key != own and key[0] == recording
        ]
        return [
            None
            if suspect is None
            else _judged(suspect, [_nearest(one, they, now) for they in others], least)
            for one, suspect in zip(seen, found, strict=True)
        ]


def _match(
    one: FaintPerson,
    free: list[_Suspect],
    known: list[_Suspect],
    calibration: Calibration,
    now: float,
) -> _Suspect | None:
    """The nearest suspect within reach that the picture has not shown yet, or a new."""
    is_look, look = one.confidence >= FAINT_FROM, calibration.log_odds(one.confidence)
    suspect = _nearest(one, [who for who in free if is_look or who.confirmed], now)
    if suspect is not None:
        free.remove(suspect)
    elif is_look:
        suspect = _Suspect(one.x, one.y, look, now, now, now, now)
        known.append(suspect)
    else:
        return None
    suspect.see(one, look, now)
    return suspect


def _nearest(
    one: FaintPerson, suspects: Sequence[_Suspect], now: float
) -> _Suspect | None:
    """The suspect that a detection is nearest to; None: it is too far from each."""
    # Nobody reaches farther, so most are passed by here.
    found, least = None, _NEAR_M + LIMITS.walking_m_s * FORGOTTEN_S
    for suspect in suspects:
        apart = math.hypot(one.x - suspect.x, one.y - suspect.y)
        if apart < least and apart <= suspect.reach_m(now) and not suspect.is_over(now):
            found, least = suspect, apart
    return found


def _judged(
    suspect: _Suspect, others: Sequence[_Suspect | None], least: float
) -> Looks:
    """Looks of all robots at a suspect, which may confirm it.

    What a robot's own looks make of it is the same whoever else looks.
    """
    seen_by = [suspect, *(one for one in others if one is not None)]
    count, probability = _sum_of(seen_by)
    # One look alone is a box like any other.
    own, own_probability = _sum_of([suspect])
    is_enough = own > 1 and own_probability >= least
    suspect.confirmed |= is_enough or suspect.most >= least
    return Looks(
        count,
        min(one.least for one in seen_by),
        max(one.most for one in seen_by),
        round(suspect.seen_at - min(one.first_at for one in seen_by), 3),
        probability,
        suspect.confirmed or (count > 1 and probability >= least),
        lent=not suspect.confirmed,
    )


def _sum_of(suspects: Sequence[_Suspect]) -> tuple[int, float]:
    """Number of all looks, and the probability that they make."""
    odds = min(SUREST, sum(one.log_odds for one in suspects))
    return sum(one.count for one in suspects), 1 / (1 + math.exp(-odds))


def _kept(known: Sequence[_Suspect], now: float) -> list[_Suspect]:
    going_on = [one for one in known if not one.is_over(now)]
    return sorted(going_on, key=lambda one: one.seen_at)[-MOST_SUSPECTS:]
