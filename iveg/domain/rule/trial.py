"""Account of a trial: a candidate version of the rule beside the version in force.

Both judge the same inputs at the same moments; the candidate acts on nothing.  Robots
drive by the limits of the version in force.  What they would do under the candidate is
not known: the account says when the limits of the two versions differ.
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
"""Longest time that one judgement stands for (s)."""
Limits = Mapping[str, SpeedLimit]
Kind = Literal["slows", "frees"]


@dataclass(frozen=True, slots=True)
class Difference:
    """A period in which the two versions limit a robot differently.

    Attributes:
        kind: ``slows``: only the candidate would slow the robot; ``frees``: only the
            version in force slows it.
        reason: Reason of the limit that slows; ``cause`` likewise.
        decision_id: Decision of the version in force; None where it has none.
        began: Start (Unix s); ``ended`` likewise, None while it goes on.
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
    """A trial and its present account.

    Attributes:
        rule: The candidate.
        by: The operator who began it; ``since`` when (Unix s).
        so_far: Its sums; None before the first judgement.
        differences: The newest differences, oldest first.
    """

    rule: DetectionRule
    by: str
    since: float
    so_far: Comparison | None = None
    differences: tuple[Difference, ...] = ()


class Account:
    """Compares both versions, judgement by judgement."""

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        self._so_far: Comparison | None = None
        self._ended: deque[Difference] = deque(maxlen=MOST_KEPT)
        self._open: dict[str, Difference] = {}
        self._at: float | None = None

    def compares_with(self, rule: DetectionRule) -> bool:
        """Whether its sums compare with this version; with another it is over."""
        return self._so_far is None or self._so_far.against == rule.version

    def judged(
        self,
        rule: DetectionRule,
        in_force: tuple[Limits, Iterable[LimitChange]],
        candidate: tuple[Limits, Iterable[LimitChange]],
        now: Instant,
    ) -> None:
        """Add one judgement of both versions; ``rule`` is the version in force."""
        elapsed_s = 0.0 if self._at is None else min(now.mono - self._at, _LONGEST_S)
        self._at, since = now.mono, self._trial.since
        before = self._so_far or Comparison(
            since, since, rule.version, 0.0, Doings(), Doings(), 0, 0
        )
        new_differences = Counter(
            self._differ(robot_id, limit, candidate[0][robot_id], now.wall)
            for robot_id, limit in in_force[0].items()
            if robot_id in candidate[0]
        )
        self._so_far = replace(
            before,
            until=now.wall,
            against=rule.version,
            compared_s=before.compared_s + elapsed_s,
            in_force=_with(before.in_force, *in_force, elapsed_s),
            candidate=_with(before.candidate, *candidate, elapsed_s),
            would_slow=before.would_slow + new_differences["slows"],
            would_not=before.would_not + new_differences["frees"],
        )

    def _differ(
        self, robot_id: str, in_force: SpeedLimit, candidate: SpeedLimit, wall: float
    ) -> Kind | None:
        """Note a difference that begins or ends now; returns the kind that began."""
        before = self._open.get(robot_id)
        kind: Kind | None = None
        if _slows(in_force) != _slows(candidate):
            kind = "slows" if _slows(candidate) else "frees"
        # A difference that turns round ends, and a new one begins below.
        if before is not None and before.kind != kind:
            self._ended.append(replace(before, ended=wall))
            del self._open[robot_id]
        if kind is None or robot_id in self._open:
            return None
        slowing = candidate if kind == "slows" else in_force
        decision_id = None if kind == "slows" else in_force.decision_id
        self._open[robot_id] = Difference(
            robot_id, kind, slowing.reason, slowing.cause, decision_id, wall
        )
        return kind

    def trial(self) -> Trial:
        """The trial with its account so far."""
        newest = (*self._ended, *self._open.values())[-MOST_KEPT:]
        return replace(self._trial, so_far=self._so_far, differences=newest)


def _with(
    done: Doings, limits: Limits, changes: Iterable[LimitChange], passed_s: float
) -> Doings:
    """Sums of a version after one more judgement."""
    # The limits of this judgement stand for the time since the one before.
    slowed_s = defaultdict(float, done.slowed_s)
    for limit in filter(_slows, limits.values()):
        slowed_s[limit.reason] += passed_s
    encounters = Counter(done.encounters)
    encounters.update(change.entry.zone.reason for change in changes if change.began)
    return Doings(slowed_s, encounters)


def _slows(limit: SpeedLimit) -> bool:
    return limit.speed_factor <= HALF_SPEED
