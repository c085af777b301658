"""The detection rule: when somebody counts, how wide a zone is; and a rule on trial."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, create_model

from iveg.domain import detection_rule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.parameters import PARAMETERS, Class, Parameter, by_keys
from iveg.domain.rule import trial
from iveg.models.base import Model, Stamp, Tenth


class Doings(Model):
    """Deeds of one version of the rule over a range."""

    slowed_s: dict[str, Tenth] = Field(
        description="Reason → seconds of a robot at half speed."
    )
    encounters: dict[str, int] = Field(
        description="Reason → how often a robot was slowed."
    )


class Comparison(Model):
    """A candidate beside the version in force, on the same inputs.

    Attributes:
        since: Begin of the range.
        until: Its end.
        in_force: What the version in force did.
        candidate: What the candidate would have done.
    """

    since: Stamp
    until: Stamp
    against: int = Field(description="The version that was in force.")
    compared_s: Tenth = Field(description="Time of the range that was compared (s).")
    in_force: Doings
    candidate: Doings
    would_slow: int = Field(
        description="How often the candidate alone would have slowed a robot."
    )
    would_not: int = Field(description="How often it alone would not have.")


class TrialDifference(Model):
    """A time in which candidate and rule in force would tell a robot otherwise.

    Attributes:
        robot_id: The robot.
        reason: Of the one that slows, as in [SpeedLimit](#speedlimit).
        cause: Its person or robot; a candidate counts people by itself, so where it
            alone slows this need not be the name on the map.
        decision_id: Decision of the rule in force; null where it has none.
        began: From then on.
        ended: Until then; null: it goes on.
    """

    robot_id: str
    kind: Literal["slows", "frees"] = Field(
        description="The candidate alone would slow it; it alone would not."
    )
    reason: str
    cause: str | None
    decision_id: str | None
    began: Stamp
    ended: Stamp | None


def parameter_fields(
    key_of: Callable[[Parameter], str], missing: Literal["refused", "none", "default"]
) -> dict[str, Any]:
    """Fields of a model: the parameters of the rule under their keys, with bounds.

    Args:
        key_of: Key of a parameter's value for every class.
        missing: What a key that is missing is.
    """
    found = dict[str, Any]()
    for row in PARAMETERS:
        number: Any = Annotated[
            float, Field(ge=row.least, le=row.most, allow_inf_nan=False)
        ]
        every = bool if row.unit == "switch" else number
        for key, default in row.written(row.default, key_of(row)).items():
            is_by_class = key == row.class_key
            type_ = dict[Class, number] if is_by_class else every
            told = f"`{row.key}` by class, where it differs." if is_by_class else ""
            first = {"refused": ..., "none": None, "default": default}[missing]
            found[key] = (
                type_ | None if missing == "none" else type_,
                Field(first, description=told or f"{row.says} {_bounds(row)}".strip()),
            )
    return found


def _bounds(row: Parameter) -> str:
    return "" if row.unit == "switch" else f"From {row.least:g} to {row.most:g}."


class _Rule(Model):
    """One version of the detection rule.

    Attributes:
        id: The rule.
        version: One more with each change.
        factor: 0.5, a constant (0–1).
        author: Who set it; ``settings`` for settings that differ from those of the last
            start, ``upgrade`` for what a new iVeg made of the last version.
        since: In force from then on.
    """

    id: str
    version: int
    factor: float = HALF_SPEED
    aliases: dict[str, Class] = Field(
        description="A detector's word → the class that it stands for."
    )
    possible_people: bool = Field(description="True; else of before it was always so.")
    comparison: Comparison | None = Field(
        description="What came of the trial that it was before."
    )
    author: str
    since: Stamp | None

    @classmethod
    def of(cls, rule: detection_rule.DetectionRule) -> "Rule":
        """One version."""
        return Rule.from_value(rule, **by_keys(rule))


if TYPE_CHECKING:
    Rule = _Rule
else:
    Rule = create_model(
        "Rule",
        __base__=_Rule,
        __doc__=_Rule.__doc__,
        **parameter_fields(lambda row: row.key, "refused"),
    )


class Trial(Model):
    """A candidate that runs beside the rule in force and acts on nothing.

    Attributes:
        rule: The candidate; its ``version`` is that of the rule that it was made from.
        by: Who began it.
        since: When.
        comparison: So far; null in the first two seconds.
    """

    rule: Rule
    by: str
    since: Stamp
    comparison: Comparison | None
    differences: list[TrialDifference] = Field(description="Newest first.")

    @classmethod
    def of(cls, tried: trial.Trial) -> Self:
        """As it stands."""
        return cls.from_value(
            tried,
            rule=Rule.of(tried.rule),
            comparison=tried.so_far,
            differences=tried.differences[::-1],
        )
