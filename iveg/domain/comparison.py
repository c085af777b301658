"""Comparison of a candidate version of the rule with the version in force."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Doings:
    """Deeds of one version over a range.

    Attributes:
        slowed_s: Reason → time of robots at half speed (s).
        encounters: Reason → number of times that a robot was slowed.
    """

    slowed_s: Mapping[str, float] = field(default_factory=dict)
    encounters: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Both versions over the same range and the same inputs.

    Attributes:
        since: Begin of the range (Unix s).
        until: End of the range (Unix s).
        against: Number of the version that was in force.
        compared_s: Compared time in the range (s): less if iVeg did not run.
        in_force: Deeds of the version in force.
        candidate: Deeds of the candidate.
        would_slow: Number of times that only the candidate would have slowed a robot.
        would_not: Number of times that only the version in force slowed a robot.
    """

    since: float
    until: float
    against: int
    compared_s: float
    in_force: Doings
    candidate: Doings
    would_slow: int
    would_not: int
