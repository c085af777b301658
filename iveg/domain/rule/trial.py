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
Kind = Literal["slows", "frees"]


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
    kind: Kind
    reason: str
    cause: str | None
    decision_id: str | None
    began: float
    ended: float | None = None


@dataclass(frozen=True, slots=True)
class Trial:
    """A trial as it stands.

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
    """Compares, judgement by judgement."""

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        self._so_far: Comparison | None = None
        self._ended: deque[Difference] = deque(maxlen=MOST_KEPT)
        self._open: dict[str, Difference] = {}
        self._at: float | None = None

    def is_of(self, rule: DetectionRule) -> bool:
        """Whether it compares with this version; else it is over."""
        return self._so_far is None or self._so_far.against == rule.version

    def judged(
        self,
        rule: DetectionRule,
        in_force: tuple[Limits, Iterable[LimitChange]],
        candidate: tuple[Limits, Iterable[LimitChange]],
        now: Instant,
    ) -> None:
        """Take one judgement of both; of ``rule``, the version in force."""
        passed = 0.0 if self._at is None else min(now.mono - self._at, _LONGEST_S)
        self._at, since = now.mono, self._trial.since
        before = self._so_far or Comparison(
            since, since, rule.version, 0.0, Doings(), Doings(), 0, 0
        )
        begun = Counter(
            self._differ(robot_id, limit, candidate[0][robot_id], now.wall)
            for robot_id, limit in in_force[0].items()
            if robot_id in candidate[0]
        )
        self._so_far = replace(
            before,
            until=now.wall,
            against=rule.version,
            compared_s=before.compared_s + passed,
            in_force=_with(before.in_force, *in_force, passed),
            candidate=_with(before.candidate, *candidate, passed),
            would_slow=before.would_slow + begun["slows"],
            would_not=before.would_not + begun["frees"],
        )

    def _differ(
        self, robot_id: str, in_force: SpeedLimit, would: SpeedLimit, wall: float
    ) -> Kind | None:
        """Note what begins and ends now; returns what began."""
        before = self._open.get(robot_id)
        kind: Kind | None = None
        if _slows(in_force) != _slows(would):
            kind = "slows" if _slows(would) else "frees"
        if before is not None and before.kind != kind:
            self._ended.append(replace(before, ended=wall))
            del self._open[robot_id]
        if kind is None or robot_id in self._open:
            return None
        by = would if kind == "slows" else in_force
        decision_id = None if kind == "slows" else in_force.decision_id
        self._open[robot_id] = Difference(
            robot_id, kind, by.reason, by.cause, decision_id, wall
        )
        return kind

    def trial(self) -> Trial:
        """The trial with its account so far."""
        differences = (*self._ended, *self._open.values())
        kept = differences[-MOST_KEPT:]
        return replace(self._trial, so_far=self._so_far, differences=kept)


def _with(
    done: Doings, limits: Limits, changes: Iterable[LimitChange], passed_s: float
) -> Doings:
    """Sums of a version after one more judgement."""
    slowed_s = defaultdict(float, done.slowed_s)
    for limit in filter(_slows, limits.values()):
        slowed_s[limit.reason] += passed_s
    encounters = Counter(done.encounters)
    encounters.update(one.entry.zone.reason for one in changes if one.began)
    return Doings(slowed_s, encounters)


def _slows(limit: SpeedLimit) -> bool:
    return limit.speed_factor <= HALF_SPEED
