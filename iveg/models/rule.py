"""The detection rule: when somebody counts, how wide a zone is; and rule trials."""

from collections.abc import Callable
from typing import Annotated, Any, Literal, Self

from pydantic import Field

from iveg.domain import comparison, detection_rule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.parameters import PARAMETERS, Class, Parameter, by_keys
from iveg.domain.rule import trial
from iveg.models.base import Model, Stamp, Tenth, members_of, with_fields


class Doings(Model):
    """Deeds of one version of the rule over a range.

    Attributes:
        slowed_s: Reason → seconds of a robot at half speed.
        encounters: Reason → number of times that a robot was slowed.
    """

    slowed_s: dict[str, Tenth]
    encounters: dict[str, int]


@members_of(comparison.Comparison, "against", "would_slow", "would_not")
class Comparison(Model):
    """A candidate beside the version in force, on the same inputs.

    Attributes:
        since: Begin of the range.
        until: Its end.
        against: The version that was in force.
        compared_s: Time of the range that was compared (s).
        in_force: Deeds of the version in force.
        candidate: Deeds of the candidate.
        would_slow: Times that only the candidate would have slowed a robot.
        would_not: Times that only the version in force slowed one.
    """

    since: Stamp
    until: Stamp
    compared_s: Tenth
    in_force: Doings
    candidate: Doings


@members_of(trial.Difference, "robot_id", "kind", "reason", "cause", "decision_id")
class TrialDifference(Model):
    """A period in which candidate and rule in force limit a robot differently.

    Attributes:
        robot_id: The robot.
        kind: The candidate alone would slow it; it alone would not.
        reason: Reason of the slowing limit, as in [SpeedLimit](#speedlimit).
        cause: Its person or robot; a candidate counts people by itself, so where it
            alone slows this need not be the name on the map.
        decision_id: Decision of the rule in force; null where it has none.
        began: From then on.
        ended: Until then; null: it goes on.
    """

    began: Stamp
    ended: Stamp | None


def parameter_fields(
    key_of: Callable[[Parameter], str], missing: Literal["refused", "none", "default"]
) -> dict[str, Any]:
    """Fields of a model: the parameters of the rule under their keys, with bounds.

    Args:
        key_of: Key of a parameter's value for every class.
        missing: Treatment of a missing key: refusal, None, or the default.
    """
    fields = dict[str, Any]()
    for row in PARAMETERS:
        number: Any = Annotated[
            float, Field(ge=row.least, le=row.most, allow_inf_nan=False)
        ]
        every = bool if row.unit == "switch" else number
        for key, default in row.written(row.default, key_of(row)).items():
            is_by_class = key == row.class_key
            type_ = dict[Class, number] if is_by_class else every
            note = f"`{row.key}` by class, where it differs." if is_by_class else ""
            first = {"refused": ..., "none": None, "default": default}[missing]
            fields[key] = (
                type_ | None if missing == "none" else type_,
                Field(first, description=note or f"{row.says} {_bounds(row)}".strip()),
            )
    return fields


def _bounds(row: Parameter) -> str:
    return "" if row.unit == "switch" else f"From {row.least:g} to {row.most:g}."


@with_fields(parameter_fields(lambda row: row.key, "refused"))
class Rule(Model):
    """One version of the detection rule.

    Attributes:
        id: The rule.
        version: One more with each change.
        factor: 0.5, a constant (0–1).
        aliases: A detector's word → the class that it stands for.
        possible_people: True; false only in versions from before it was always so.
        comparison: Result of its trial; null where it had none.
        author: Who set it; ``settings`` for settings that differ from those of the last
            start, ``upgrade`` for what a new iVeg made of the last version.
        since: In force from then on.
    """

    id: str
    version: int
    factor: float = HALF_SPEED
    aliases: dict[str, Class]
    possible_people: bool
    comparison: Comparison | None
    author: str
    since: Stamp | None

    @classmethod
    def from_rule(cls, rule: detection_rule.DetectionRule) -> Self:
        """One version."""
        return cls.from_value(rule, **by_keys(rule))


class Trial(Model):
    """A candidate that runs beside the rule in force and acts on nothing.

    Attributes:
        rule: The candidate; its ``version`` is that of the rule that it was made from.
        by: Who began it.
        since: When.
        comparison: So far; null in the first two seconds.
        differences: Newest first.
    """

    rule: Rule
    by: str
    since: Stamp
    comparison: Comparison | None
    differences: list[TrialDifference]

    @classmethod
    def from_trial(cls, tried: trial.Trial) -> Self:
        """A trial as it stands."""
        return cls.from_value(
            tried,
            rule=Rule.from_rule(tried.rule),
            comparison=tried.so_far,
            differences=tried.differences[::-1],
        )
