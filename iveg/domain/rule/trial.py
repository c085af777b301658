"""The account of a trial: a candidate version of the rule beside the one in force.

Both judge the same inputs at the same moments; the candidate acts on nothing.  Robots
drive as the version in force has them drive, so what they would have done under the
candidate is not known: the account says when the two would have told them otherwise.
"""

from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

from iveg.domain.comparison import Comparison, Doings
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED, SpeedLimit
from iveg.domain.observations import Instant
from iveg.domain.rule.zones import LimitChange

MOST_KEPT: Final = 200
"""Differences in the list; all are counted."""
_LONGEST_S: Final = 1.0
"""A judgement after a longer silence does not stand for all of it."""
Limits = Mapping[str, SpeedLimit]


@dataclass(frozen=True, slots=True)
class Difference:
    """A time in which the two would have told a robot otherwise.

    Attributes:
        kind: ``slows``: the candidate alone would have slowed it; ``frees``: it alone
            would not.
        reason: Of the one that slows; ``cause`` likewise.
        decision_id: Of the version in force; None where it slows for no decision.
        began: Unix seconds; ``ended`` likewise, None while it goes on.
    """

    robot_id: str
    kind: Literal["slows", "frees"]
    reason: str
    cause: str | None
    decision_id: str | None
    began: float
    ended: float | None = None


@dataclass(slots=True)
class _Sums:
    """What one version did so far."""

    slowed_s: defaultdict[str, float]
    encounters: Counter[str]

    @classmethod
    def of(cls, done: Doings) -> "_Sums":
        return cls(defaultdict(float, done.slowed_s), Counter(done.encounters))

    def add(self, limits: Iterable[SpeedLimit], passed_s: float) -> None:
        for limit in limits:
            if _slows(limit):
                self.slowed_s[limit.reason] += passed_s

    def meet(self, changes: Iterable[LimitChange]) -> None:
        self.encounters.update(one.entry.zone.reason for one in changes if one.began)

    def doings(self) -> Doings:
        seconds = {why: round(s, 3) for why, s in self.slowed_s.items()}
        return Doings(seconds, dict(self.encounters))


@dataclass(frozen=True, slots=True)
class Trial:
    """A trial as it is written down.

    Attributes:
        rule: The candidate.
        by: Who began it; ``since`` when (Unix s).
        so_far: What came of it; None before the first judgement.
        differences: The newest, oldest first.
    """

    rule: DetectionRule
    by: str
    since: float
    so_far: Comparison | None = None
    differences: tuple[Difference, ...] = ()


class Account:
    """Compares, judgement by judgement.

    Args:
        trial: As it was written down last.
    """

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        before = trial.so_far
        self._in_force = _Sums.of(Doings() if before is None else before.in_force)
        self._candidate = _Sums.of(Doings() if before is None else before.candidate)
        self._counts = Counter[str]()
        self._since = trial.since if before is None else before.since
        self._until = self._since if before is None else before.until
        self._compared_s = 0.0 if before is None else before.compared_s
        self._against = None if before is None else before.against
        if before is not None:
            self._counts.update(slows=before.would_slow, frees=before.would_not)
        # What went on when iVeg ended, ended with it.
        self._ended: deque[Difference] = deque(
            (_over(one, self._until) for one in trial.differences), MOST_KEPT
        )
        self._open: dict[str, Difference] = {}
        self._at: float | None = None

    def is_of(self, rule: DetectionRule) -> bool:
        """Whether it compares with this version; else it is over."""
        return self._against in (None, rule.version)

    def judged(
        self,
        rule: DetectionRule,
        in_force: tuple[Limits, Iterable[LimitChange]],
        candidate: tuple[Limits, Iterable[LimitChange]],
        now: Instant,
    ) -> None:
        """Take one judgement of both; of ``rule``, the version in force."""
        self._against = rule.version
        passed = 0.0 if self._at is None else min(now.mono - self._at, _LONGEST_S)
        self._at, self._until = now.mono, now.wall
        self._compared_s += passed
        sums = (self._in_force, in_force), (self._candidate, candidate)
        for sum_, (limits, changes) in sums:
            sum_.add(limits.values(), passed)
            sum_.meet(changes)
        for robot_id, limit in in_force[0].items():
            if robot_id in candidate[0]:
                self._differ(robot_id, limit, candidate[0][robot_id], now.wall)

    def _differ(
        self, robot_id: str, in_force: SpeedLimit, would: SpeedLimit, wall: float
    ) -> None:
        before = self._open.get(robot_id)
        kind: Literal["slows", "frees"] | None = None
        if _slows(in_force) != _slows(would):
            kind = "slows" if _slows(would) else "frees"
        if before is not None and before.kind != kind:
            self._ended.append(replace(before, ended=wall))
            del self._open[robot_id]
        if kind is not None and robot_id not in self._open:
            by = would if kind == "slows" else in_force
            decision_id = None if kind == "slows" else in_force.decision_id
            self._open[robot_id] = Difference(
                robot_id, kind, by.reason, by.cause, decision_id, wall
            )
            self._counts[kind] += 1

    def trial(self) -> Trial:
        """As it stands."""
        differences = (*self._ended, *self._open.values())
        return replace(
            self._trial,
            so_far=None if self._against is None else self._comparison(self._against),
            differences=differences[-MOST_KEPT:],
        )

    def _comparison(self, against: int) -> Comparison:
        return Comparison(
            self._since,
            self._until,
            against,
            round(self._compared_s, 3),
            self._in_force.doings(),
            self._candidate.doings(),
            self._counts["slows"],
            self._counts["frees"],
        )


def _slows(limit: SpeedLimit) -> bool:
    return limit.speed_factor <= HALF_SPEED


def _over(one: Difference, until: float) -> Difference:
    return one if one.ended is not None else replace(one, ended=until)
