"""The detection rule: when somebody counts, and how wide the ring is."""

from pydantic import Field

from iveg.domain import detection_rule
from iveg.domain.detection_rule import Class
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.rule import trial
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, stamp
from iveg.models.comparison import Comparison, TrialDifference, compared


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
