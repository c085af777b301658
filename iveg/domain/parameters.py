"""Parameters of the detection rule: one row each.

These read the table: settings, REST, stored lines, the strictest of several rules,
audit, evidence of decisions, log, and the feedback to robots.  So does the form on the
page, which asks again where a change protects less.  The texts of a row are
``rule.part.{word}`` and ``lowering.{word}`` of the translations.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, Final, Literal, get_args

from pydantic import Field, FiniteFloat, TypeAdapter
from pydantic.dataclasses import dataclass as checked_dataclass

from iveg.domain.limits import LIMITS

Class = Literal["person", "robot"]
CLASSES: Final[tuple[Class, ...]] = get_args(Class)
Unit = Literal["share", "m", "s", "switch"]

FORESIGHT_LEAST_S: Final = 0.5
"""The shortest horizon of foresight (s)."""
FORESIGHT_MOST_S: Final = 3.0
"""The longest horizon (s), up to which forecasts were measured."""


@dataclass(frozen=True, slots=True)
class ByClass:
    """A value for every class, with exceptions for some classes."""

    every: float
    by_class: Mapping[Class, float] = field(default_factory=dict)

    def for_class(self, class_: Class | None) -> float:
        """The value for a canonical class; None: any other class."""
        return self.every if class_ is None else self.by_class.get(class_, self.every)

    @property
    def values(self) -> tuple[float, ...]:
        """All values in it."""
        return self.every, *self.by_class.values()


Value = float | ByClass
"""Value of a parameter; a switch is a float as well, 0 or 1."""
Name = Annotated[str, Field(pattern=r"^[a-z][a-z_]*$")]
_UNIQUE: Final = ("name", "key", "class_key", "variable")


@checked_dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One row.

    Attributes:
        name: Field of ``Parameters``; key in stored lines and evidence.
        default: Value without a setting.
        key: Key in REST and the audit.
        class_key: Key of values by class, in REST and stored lines; None: all classes
            have one value.
        unit: Unit of the value.
        least: Least value.
        most: Greatest value.
        protects: Whether a greater value protects more or less.
        variable: Name of its setting.
        says: Explanation of its setting.
        word: Last part of the keys of its texts.
        robots: Whether robots are sent it.
    """

    name: Name
    default: bool | Value
    key: Name
    class_key: Name | None
    unit: Unit
    least: FiniteFloat
    most: FiniteFloat
    protects: Literal["more", "less"]
    variable: Annotated[str, Field(pattern=r"^IVEG_[A-Z_]+$")]
    says: str
    word: Name
    robots: bool

    def __post_init__(self) -> None:
        """Check the default.  Raises ValueError."""
        if not (
            isinstance(self.default, ByClass) == (self.class_key is not None)
            and isinstance(self.default, bool) == (self.unit == "switch")
            and self.least <= min(all_values(self.default))
            and max(all_values(self.default)) <= self.most
        ):
            raise ValueError(f"default {self.default} does not fit its row")

    def written(self, value: Value, key: str) -> dict[str, object]:
        """A value under its keys; ``key``: key of the value for every class."""
        if isinstance(value, ByClass) and self.class_key is not None:
            return {key: value.every, self.class_key: dict(value.by_class)}
        return {key: value}

    def read(self, document: Mapping[str, Any], before: Value, key: str) -> Value:
        """The value under its keys; a missing part or None stays as ``before``."""
        every = document.get(key)
        if not isinstance(before, ByClass):
            return before if every is None else every
        by_class = document.get(self.class_key or "")
        return ByClass(
            before.every if every is None else every,
            before.by_class if by_class is None else by_class,
        )

    def strictest(self, several: Iterable[Value]) -> Value:
        """The most protective of several values, for any class."""
        numbers = [number for value in several for number in all_values(value)]
        strictest = max(numbers) if self.protects == "more" else min(numbers)
        return ByClass(strictest) if self.class_key is not None else strictest


def all_values(value: Value) -> tuple[float, ...]:
    """All numbers in a value."""
    return value.values if isinstance(value, ByClass) else (value,)


def _row(default: Any, **facts: Any) -> Any:
    """A row of the table."""
    return field(
        default=default,
        metadata={"default": default, "class_key": None, "robots": False, **facts},
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """The table: a field is a parameter, and its metadata are the rest of its row."""

    threshold: ByClass = _row(
        ByClass(LIMITS.detection_threshold),
        key="confidence_threshold",
        class_key="class_thresholds",
        unit="share",
        least=0.0,
        most=1.0,
        protects="less",
        variable="IVEG_CONFIDENCE_THRESHOLD",
        says="Least confidence that raises an alert, inclusive.",
        word="threshold",
    )
    radius_m: ByClass = _row(
        ByClass(LIMITS.zone_default_m),
        key="radius_m",
        class_key="class_radii_m",
        unit="m",
        least=LIMITS.zone_least_m,
        most=LIMITS.zone_most_m,
        protects="more",
        variable="IVEG_SAFETY_RADIUS_M",
        says="Zone round a person or peer while fresh, inclusive (m).",
        word="radius",
        robots=True,
    )
    foresight: bool = _row(
        True,
        key="foresight",
        unit="switch",
        least=False,
        most=True,
        protects="more",
        variable="IVEG_FORESIGHT",
        says="Whether a robot slows before it reaches a zone, to be slow there.",
        word="foresight",
    )
    foresight_s: float = _row(
        FORESIGHT_MOST_S,
        key="foresight_s",
        unit="s",
        least=FORESIGHT_LEAST_S,
        most=FORESIGHT_MOST_S,
        protects="more",
        variable="IVEG_FORESIGHT_S",
        says="How far ahead that looks (s).",
        word="foresight_s",
    )


_ROWS = TypeAdapter(dict[str, Parameter])


def parameters_of(table: Any) -> tuple[Parameter, ...]:
    """The rows of a table.

    Raises:
        ValueError: with the name of a wrong row.
    """
    rows = {row.name: {"name": row.name, **row.metadata} for row in fields(table)}
    used = Counter(
        name for row in rows.values() for name in {row.get(part) for part in _UNIQUE}
    )
    if several := [name for name, uses in used.items() if name and uses > 1]:
        raise ValueError(f"rule parameters share {several}")
    return tuple(_ROWS.validate_python(rows).values())


PARAMETERS: Final = parameters_of(Parameters)
SENT_PARAMETERS: Final = tuple(row for row in PARAMETERS if row.robots)

Sent = Mapping[str, Mapping[Class, float]]
"""Parameter → class → value, as in the feedback to robots."""


def by_keys(parameters: Parameters) -> dict[str, object]:
    """All values under their keys in REST."""
    return _written(parameters, "key")


def by_names(parameters: Parameters) -> dict[str, object]:
    """All values under their keys in stored lines."""
    return _written(parameters, "name")


def _written(parameters: Parameters, key: Literal["key", "name"]) -> dict[str, object]:
    flat = dict[str, object]()
    for row in PARAMETERS:
        flat |= row.written(getattr(parameters, row.name), getattr(row, key))
    return flat


def for_class(parameters: Parameters, class_: Class) -> dict[str, float]:
    """The values for a class, by name."""
    return {
        row.name: _for_class(getattr(parameters, row.name), class_)
        for row in PARAMETERS
    }


def sent_to_robots(parameters: Parameters) -> Sent:
    """The values that robots are sent, for each class."""
    return {
        row.name: {
            class_: _for_class(getattr(parameters, row.name), class_)
            for class_ in CLASSES
        }
        for row in SENT_PARAMETERS
    }


def _for_class(value: Value, class_: Class) -> float:
    return value.for_class(class_) if isinstance(value, ByClass) else value
