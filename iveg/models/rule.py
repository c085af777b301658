"""The detection rule: when somebody counts, and how wide the ring is."""

from typing import Literal

from pydantic import Field

from iveg.domain import comparison, detection_rule
from iveg.domain.detection_rule import Class
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.rule import trial
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, stamp


class Doings(Model):
    """What one version of the rule did over a range."""

    slowed_s: dict[str, float] = Field(
        description="Reason → seconds of a robot at half speed."
    )
    encounters: dict[str, int] = Field(
        description="Reason → how often a robot was slowed."
    )

    @classmethod
    def of(cls, done: comparison.Doings) -> "Doings":
        """One version's."""
        seconds = {why: round(s, 1) for why, s in done.slowed_s.items()}
        return cls(slowed_s=seconds, encounters=dict(done.encounters))


class Comparison(Model):
    """A candidate beside the version in force, on the same inputs."""

    since: str
    until: str
    against: int = Field(description="The version that was in force.")
    compared_s: float = Field(description="Time of the range that was compared (s).")
    in_force: Doings
    candidate: Doings
    would_slow: int = Field(
        description="How often the candidate alone would have slowed a robot."
    )
    would_not: int = Field(description="How often it alone would not have.")

    @classmethod
    def of(cls, found: comparison.Comparison) -> "Comparison":
        """One of them."""
        return cls(
            since=format_stamp(found.since),
            until=format_stamp(found.until),
            against=found.against,
            compared_s=round(found.compared_s, 1),
            in_force=Doings.of(found.in_force),
            candidate=Doings.of(found.candidate),
            would_slow=found.would_slow,
            would_not=found.would_not,
        )


class Rule(Model):
    """One version of the detection rule."""

    id: str
    version: int
    confidence_threshold: float = Field(
        description="0 to 1, inclusive; ``class_thresholds`` by class."
    )
    class_thresholds: dict[Class, float]
    radius_m: float
    factor: float
    aliases: dict[str, Class] = Field(
        description="A detector's word → the class that it stands for."
    )
    possible_people: bool = Field(description="True; else of before it was always so.")
    foresight: bool
    foresight_s: float = Field(description="How far ahead foresight looks (s).")
    comparison: Comparison | None = Field(
        description="What came of the trial that it was before."
    )
    author: str
    since: str | None

    @classmethod
    def of(cls, rule: detection_rule.DetectionRule) -> "Rule":
        """One version."""
        return cls(
            id=rule.id,
            version=rule.version,
            confidence_threshold=rule.threshold,
            class_thresholds=dict(rule.class_thresholds),
            radius_m=rule.radius_m,
            factor=HALF_SPEED,
            aliases=dict(rule.aliases),
            possible_people=rule.possible_people,
            foresight=rule.foresight,
            foresight_s=rule.foresight_s,
            comparison=compared(rule.comparison),
            author=rule.author,
            since=stamp(rule.since),
        )


class TrialDifference(Model):
    """A time in which candidate and rule in force would tell a robot otherwise."""

    robot_id: str
    kind: Literal["slows", "frees"] = Field(
        description="The candidate alone would slow it; it alone would not."
    )
    reason: str
    cause: str | None
    decision_id: str | None
    began: str
    ended: str | None

    @classmethod
    def of(cls, one: trial.Difference) -> "TrialDifference":
        """One of them."""
        return cls(
            robot_id=one.robot_id,
            kind=one.kind,
            reason=one.reason,
            cause=one.cause,
            decision_id=one.decision_id,
            began=format_stamp(one.began),
            ended=stamp(one.ended),
        )


class Trial(Model):
    """A candidate that runs beside the rule in force and acts on nothing."""

    rule: Rule
    by: str
    since: str
    comparison: Comparison | None
    differences: list[TrialDifference] = Field(description="Newest first.")

    @classmethod
    def of(cls, tried: trial.Trial) -> "Trial":
        """As it stands."""
        return cls(
            rule=Rule.of(tried.rule),
            by=tried.by,
            since=format_stamp(tried.since),
            comparison=compared(tried.so_far),
            differences=[
                TrialDifference.of(one) for one in reversed(tried.differences)
            ],
        )


def compared(found: comparison.Comparison | None) -> Comparison | None:
    """What came of a trial, if there was one."""
    return None if found is None else Comparison.of(found)
