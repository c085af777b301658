"""A candidate version of the rule beside the one in force: what each did."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Doings:
    """Deeds of one version over a range.

    Attributes:
        slowed_s: Reason → seconds of a robot at half speed.
        encounters: Reason → how often a robot was slowed.
    """

    slowed_s: Mapping[str, float] = field(default_factory=dict)
    encounters: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Both versions over the same range and the same inputs.

    Attributes:
        since: Begin of the range (Unix s); ``until`` its end.
        against: The version that was in force.
        compared_s: Time in it that was compared (s): less where iVeg did not run.
        would_slow: How often the candidate would have slowed a robot that drove on.
        would_not: How often it would not have slowed one that was slowed.
    """

    since: float
    until: float
    against: int
    compared_s: float
    in_force: Doings
    candidate: Doings
    would_slow: int
    would_not: int
