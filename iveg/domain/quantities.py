"""Quantities of a message: each declared once, at the member that holds the value."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_type_hints

from annotated_types import Ge, GroupedMetadata, Le
from pydantic import Strict


@dataclass(frozen=True, slots=True)
class Quantity(GroupedMetadata):
    """Unit, meaning and bounds of one member of a message.

    Attributes:
        unit: SI unit, or a range such as ``0–1``; ``–``: none.
        least: Smallest accepted value; None: no bound.
        most: Greatest accepted value; None: no bound.
    """

    unit: str
    meaning: str
    least: float | None = None
    most: float | None = None

    def __iter__(self) -> Iterator[object]:
        """Checks of a value by pydantic."""
        # A text or truth value in place of a number is another program's mistake.
        yield Strict()
        if self.least is not None:
            yield Ge(self.least)
        if self.most is not None:
            yield Le(self.most)


_QUANTITIES: dict[type, dict[str, Quantity]] = {}


def quantities_of(message: type) -> dict[str, Quantity]:
    """Quantities of a message, by name.

    Every frame of a page needs them for each robot, so they are looked up once.
    """
    if message not in _QUANTITIES:
        _QUANTITIES[message] = {
            name: part
            for name, hint in get_type_hints(message, include_extras=True).items()
            for part in getattr(hint, "__metadata__", ())
            if isinstance(part, Quantity)
        }
    return _QUANTITIES[message]


def flags_of(message: type) -> list[str]:
    """Names of the quantities of a small sensor that are true or false."""
    types = get_type_hints(message)
    return [name for name in quantities_of(message) if types[name] == bool | None]


def value_of(observation: object) -> dict[str, Any]:
    """Values of a small sensor, by name of the quantity."""
    return {
        name: getattr(observation, name) for name in quantities_of(type(observation))
    }
