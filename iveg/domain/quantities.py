"""The quantities of a small sensor: declared once, at the member of its value."""

from dataclasses import dataclass, field, fields
from typing import Any


@dataclass(frozen=True, slots=True)
class Quantity:
    """What one member of a small sensor's value is, on every way it takes.

    Attributes:
        unit: SI, or such as ``0–1``; ``–``: none.
        least: Smallest value that is read; a smaller one is refused.
        most: Greatest value that is read.
    """

    unit: str
    meaning: str
    least: float | None = None
    most: float | None = None


def quantity(
    unit: str, meaning: str, least: float | None = None, most: float | None = None
) -> Any:
    """A member of a small sensor's observation; None where it is not known."""
    return field(
        default=None, metadata={"quantity": Quantity(unit, meaning, least, most)}
    )


_QUANTITIES: dict[type, dict[str, Quantity]] = {}


def quantities_of(of: type) -> dict[str, Quantity]:
    """The members of a small sensor's value, by name.

    Asked for each robot in each frame of a page, so it is looked up once.
    """
    if of not in _QUANTITIES:
        found = {one.name: one.metadata.get("quantity") for one in fields(of)}
        _QUANTITIES[of] = {n: one for n, one in found.items() if one is not None}
    return _QUANTITIES[of]


def flags_of(of: type) -> list[str]:
    """The quantities of a small sensor that are true or false, by name."""
    types = {one.name: one.type for one in fields(of)}
    return [name for name in quantities_of(of) if types[name] == bool | None]


def value_of(observation: object) -> dict[str, Any]:
    """What a small sensor says, by name."""
    return {
        name: getattr(observation, name) for name in quantities_of(type(observation))
    }
