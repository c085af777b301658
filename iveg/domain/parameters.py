"""Parameters of the detection rule: one row each, from which all else follows.

Settings, REST, stored lines, the strictest of several rules, audit, evidence of
decisions, log, what robots are sent, and the form on the page with its question where a
change protects less are read from here.  A row's texts are ``rule.part.{word}`` and
``lowering.{word}`` of the translations.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Final, Literal, get_args

from iveg.domain.limits import LIMITS

Class = Literal["person", "robot"]
CLASSES: Final[tuple[Class, ...]] = get_args(Class)
Unit = Literal["share", "m", "s", "switch"]

FORESIGHT_LEAST_S: Final = 0.5
"""The shortest horizon of foresight (s)."""
FORESIGHT_MOST_S: Final = 3.0
"""The farthest (s): so far it was measured how much comes true."""


@dataclass(frozen=True, slots=True)
class ByClass:
    """A value for every class, and others for some of them."""

    every: float
    by_class: Mapping[Class, float] = field(default_factory=dict)

    def of(self, class_: Class | None) -> float:
        """The value of a canonical class; None stands for any other class."""
        return self.every if class_ is None else self.by_class.get(class_, self.every)

    @property
    def values(self) -> tuple[float, ...]:
        """All that stand in it."""
        return self.every, *self.by_class.values()


Value = float | ByClass
"""A switch is a float, too: 0 or 1, as Python counts a bool."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One row.

    Attributes:
        name: Field of ``Parameters``; key of stored lines and of evidence.
        default: Unless a setting says otherwise.
        key: In REST and the audit.
        class_key: In REST and stored lines, key of values by class; None: one for all.
        least: Least value; ``most`` likewise the greatest.
        protects: What a greater value does.
        variable: Name of its setting; ``says`` explains it.
        word: Of its texts.
        robots: Whether robots are sent it.
    """

    name: str
    default: Value
    key: str
    class_key: str | None
    unit: Unit
    least: float
    most: float
    protects: Literal["more", "less"]
    variable: str
    says: str
    word: str
    robots: bool

    def __post_init__(self) -> None:
        """Refuse a row that cannot be meant.

        Raises:
            ValueError: with the name of the row.
        """
        is_by_class = isinstance(self.default, ByClass)
        if is_by_class != (self.class_key is not None):
            raise ValueError(f"rule parameter {self.name}: class_key and default")
        if not all(self.least <= one <= self.most for one in values_of(self.default)):
            raise ValueError(f"rule parameter {self.name}: default out of bounds")

    def written(self, value: Value, key: str) -> dict[str, object]:
        """A value under its keys; ``key``: that of the value for every class."""
        if isinstance(value, ByClass) and self.class_key is not None:
            return {key: value.every, self.class_key: dict(value.by_class)}
        return {key: value}

    def read(self, told: Mapping[str, Any], before: Value, key: str) -> Value:
        """The value under its keys; what is missing or None stays as it was before."""
        every = told.get(key)
        if not isinstance(before, ByClass):
            return before if every is None else every
        by_class = told.get(self.class_key or "")
        return ByClass(
            before.every if every is None else every,
            before.by_class if by_class is None else by_class,
        )

    def strictest(self, several: Iterable[Value]) -> Value:
        """The value that protects as much as each of them, for any class."""
        all_ = [one for value in several for one in values_of(value)]
        found = max(all_) if self.protects == "more" else min(all_)
        return ByClass(found) if self.class_key is not None else found


def values_of(value: Value) -> tuple[float, ...]:
    """All numbers that stand in a value."""
    return value.values if isinstance(value, ByClass) else (value,)


def _row(default: Any, **facts: Any) -> Any:
    """A row of the table."""
    row = {"default": default, "class_key": None, "robots": False, **facts}
    return field(default=default, metadata=row)


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """The table: each field is a parameter, its metadata the rest of its row."""

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


PARAMETERS: Final = tuple(
    Parameter(name=one.name, **one.metadata) for one in fields(Parameters)
)
ROBOTS_HEAR: Final = tuple(one for one in PARAMETERS if one.robots)

Sent = Mapping[str, Mapping[Class, float]]
"""Parameter → class → value, as robots are sent it."""


def by_keys(parameters: Parameters) -> dict[str, object]:
    """All values, as REST has them."""
    return _written(parameters, "key")


def by_names(parameters: Parameters) -> dict[str, object]:
    """All values, as stored lines have them."""
    return _written(parameters, "name")


def _written(parameters: Parameters, key: Literal["key", "name"]) -> dict[str, object]:
    flat = dict[str, object]()
    for row in PARAMETERS:
        flat |= row.written(getattr(parameters, row.name), getattr(row, key))
    return flat


def for_class(parameters: Parameters, class_: Class) -> dict[str, float]:
    """The values that count for a class, by name."""
    return {row.name: _of(getattr(parameters, row.name), class_) for row in PARAMETERS}


def sent_to_robots(parameters: Parameters) -> Sent:
    """The values that robots are sent, of each class."""
    return {
        row.name: {
            class_: _of(getattr(parameters, row.name), class_) for class_ in CLASSES
        }
        for row in ROBOTS_HEAR
    }


def _of(value: Value, class_: Class) -> float:
    return value.of(class_) if isinstance(value, ByClass) else value
