"""The quantities of a message: declared once, at the member that holds the value."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_type_hints

from annotated_types import Ge, GroupedMetadata, Le
from pydantic import Strict


@dataclass(frozen=True, slots=True)
class Quantity(GroupedMetadata):
    """Unit, meaning and bounds of one member of a message; None: not known.

    Attributes:
        unit: SI, or such as ``0–1``; ``–``: none.
        least: Smallest value that is read; a smaller one is refused.
        most: Greatest value that is read.
    """

    unit: str
    meaning: str
    least: float | None = None
    most: float | None = None

    def __iter__(self) -> Iterator[object]:
        """Checks of a value that is read."""
        yield Strict()
        if self.least is not None:
            yield Ge(self.least)
        if self.most is not None:
            yield Le(self.most)


_QUANTITIES: dict[type, dict[str, Quantity]] = {}


def quantities_of(message: type) -> dict[str, Quantity]:
    """The quantities of a message, by name.

    Asked for each robot in each frame of a page, so they are looked up once.
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
    """The quantities of a small sensor that are true or false, by name."""
    types = get_type_hints(message)
    return [name for name in quantities_of(message) if types[name] == bool | None]


def value_of(observation: object) -> dict[str, Any]:
    """Values of a small sensor, by name."""
    return {
        name: getattr(observation, name) for name in quantities_of(type(observation))
    }
