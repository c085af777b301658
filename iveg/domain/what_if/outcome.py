"""What came of a judgement over a range: time slowed, encounters, near misses."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Final

import numpy as np

from iveg.domain.day import length
from iveg.domain.limits import LIMITS
from iveg.domain.what_if.inputs import Flags, Floats
from iveg.domain.what_if.judging import Range, Stretch
from iveg.domain.what_if.parameters import Parameters
from iveg.domain.what_if.steps import STEP_S, Grid
from iveg.domain.what_if.truth import false_alarms, missed

_REASONS: Final = "person", "robot"
"""The gravest first: of two causes at once that counts."""
_APART_S: Final = 10.0
"""Nearer in time, one robot near somebody is one near miss."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Of one version over one range, of the whole fleet.

    Attributes:
        slowed_s: Reason → seconds of a robot at reduced speed.
        encounters: Reason → how often a robot was slowed.
        near_misses: How often a robot drove unslowed within two metres of where
            somebody had been seen within a second; ``near_s`` for how long (s).
        lost_s: What slowing cost: seconds of driving that were not driven.
        missed_s: Unslowed while somebody really was near (s); None: truth is not known.
        false_s: Slowed for a person while nobody really was (s).
    """

    slowed_s: Mapping[str, float] = field(default_factory=dict)
    encounters: Mapping[str, int] = field(default_factory=dict)
    near_misses: int = 0
    near_s: float = 0.0
    lost_s: float = 0.0
    missed_s: float | None = None
    false_s: float | None = None

    def __add__(self, other: "Outcome") -> "Outcome":
        """Of both ranges together."""
        return Outcome(
            {
                why: self.slowed_s.get(why, 0.0) + other.slowed_s.get(why, 0.0)
                for why in {**self.slowed_s, **other.slowed_s}
            },
            dict(Counter(self.encounters) + Counter(other.encounters)),
            self.near_misses + other.near_misses,
            self.near_s + other.near_s,
            self.lost_s + other.lost_s,
            _both(self.missed_s, other.missed_s),
            _both(self.false_s, other.false_s),
        )


def _both(one: float | None, other: float | None) -> float | None:
    return other if one is None else one + (other or 0.0)


def outcomes_of(
    range_: Range, tried: Sequence[Parameters], leads_s: float = 0.0
) -> tuple[Outcome, ...]:
    """What each would have done, without the first ``leads_s`` seconds."""
    lead = round(leads_s / STEP_S)
    each = {
        one: _outcome(range_, one, found, lead)
        for one, found in range_.judge_all(tried).items()
    }
    return tuple(each[one] for one in tried)


def _outcome(
    range_: Range, tried: Parameters, found: Iterable[Stretch], lead: int
) -> Outcome:
    of: dict[str, list[Stretch]] = defaultdict(list)
    for one in found:
        of[one.robot_id].append(one)
    each = (
        _of_robot(
            grid,
            of[robot_id],
            range_.near(robot_id),
            range_.away.get(robot_id),
            tried,
            lead,
        )
        for robot_id, grid in range_.grids.items()
    )
    return reduce(lambda one, other: one + other, each, Outcome())


def _of_robot(
    grid: Grid,
    stretches: Iterable[Stretch],
    near: Flags,
    away: Floats | None,
    tried: Parameters,
    lead: int,
) -> Outcome:
    heard = grid.age <= LIMITS.silence_s
    heard[:lead] = False
    slowed = {why: np.zeros(len(grid.age), np.bool_) for why in _REASONS}
    met = Counter[str]()
    for one in stretches:
        slowed[one.reason][one.first : one.end] = True
        met[one.reason] += one.first >= lead
    any_of = slowed["person"] | slowed["robot"]
    slowed["robot"] &= ~slowed["person"]
    drives = heard & (np.abs(grid.linear) >= LIMITS.standing_speed)
    unslowed = drives & near & ~any_of
    truth: tuple[float | None, float | None] = (None, None)
    if away is not None and not np.isnan(away[lead:]).all():
        judged = (
            missed(away, drives, any_of),
            false_alarms(away, drives, slowed["person"]),
        )
        truth = _seconds(judged[0]), _seconds(judged[1])
    return Outcome(
        {why: _seconds(mask & heard) for why, mask in slowed.items()},
        {why: count for why, count in met.items() if count},
        _runs(unslowed),
        _seconds(unslowed),
        (1.0 - tried.factor) * _seconds(drives & any_of),
        *truth,
    )


def _seconds(mask: Flags) -> float:
    return float(np.count_nonzero(mask)) * STEP_S


def _runs(mask: Flags) -> int:
    """How many there are that are farther apart than that."""
    steps = np.flatnonzero(mask)
    if not len(steps):
        return 0
    return 1 + int(np.count_nonzero(np.diff(steps) > _APART_S / STEP_S))


Decided = tuple[str, str, float, float | None]
"""Of a decision: robot, reason, begin and end (Unix s; None: it goes on)."""


def recorded(decided: Iterable[Decided], since: float, until: float) -> Outcome:
    """What was decided in a range; near misses and lost time are not known of it."""
    spans: dict[tuple[str, str], list[tuple[float, float]]] = defaultdict(list)
    met = Counter[str]()
    for robot_id, reason, began, ended in decided:
        end = until if ended is None else min(ended, until)
        spans[reason, robot_id].append((max(began, since), end))
        met[reason] += since <= began < until
    slowed: defaultdict[str, float] = defaultdict(float)
    for (reason, _), found in spans.items():
        slowed[reason] += length(found)
    return Outcome(dict(slowed), {why: n for why, n in met.items() if n})
