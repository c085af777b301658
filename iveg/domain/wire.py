"""Types of the members of messages, with their bounds and digits.

A message is a dataclass of these types, so it is declared once.  ``iveg.ngsi.codec``
reads and writes it by that declaration.  Nothing is coerced; NaN is no number.
"""

import unicodedata
from collections.abc import Callable
from operator import not_
from typing import Annotated, Final

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    Strict,
    ValidationError,
    WrapValidator,
)

# --- texts ------------------------------------------------------------------------

MAX_TEXT = 64
FORBIDDEN = frozenset("<>\"'=;()")
"""Characters that Orion refuses, with the whole update they stand in."""


def clean_text(text: str) -> str:
    """Text that is safe to keep and show: NFC, no control or format marks, short."""
    if text.isascii() and text.isprintable():
        # Fast path: nearly all text is plain, and the loop below is slow.
        return text[:MAX_TEXT]
    legible_text = "".join(
        character
        # Four times: a normalised character may be made of several.
        for character in unicodedata.normalize("NFC", text[: 4 * MAX_TEXT])
        if unicodedata.category(character)[0] != "C"
    )
    return legible_text[:MAX_TEXT]


def legible(text: str) -> str:
    """Text without invisible and direction-changing characters (Cc, Cf, Cs …).

    Line ends stay.
    """
    return "".join(c for c in text if c == "\n" or unicodedata.category(c)[0] != "C")


def all_legible(value: object) -> object:
    """JSON with every text in it legible."""
    match value:
        case str():
            return legible(value)
        case list():
            return [all_legible(part) for part in value]
        case dict():
            return {legible(name): all_legible(part) for name, part in value.items()}
    return value


# --- bounds of lists --------------------------------------------------------------

MAX_BEAMS = 4096
MAX_RANGE_M = 1e6
MAX_BOXES = 256
MAX_ROBOTS = 256
MAX_PATH = 1024

# --- members ----------------------------------------------------------------------


def digits(count: int) -> PlainSerializer:
    """Serialiser that writes so many digits after the point."""

    def rounded(value: float) -> float:
        return round(value, count)

    return PlainSerializer(rounded, return_type=float)


def known_text(*words: str) -> AfterValidator:
    """Validator that accepts these texts only."""

    def known(text: str) -> str:
        if text not in words:
            raise ValueError("not one of the known words")
        return text

    return AfterValidator(known)


def place(axes: str, count: int = 4) -> tuple[BeforeValidator, PlainSerializer]:
    """Tuple of numbers that is ``{"x": …, "y": …}`` on the wire; z may be missing."""

    def read(value: object) -> object:
        if not isinstance(value, dict):
            raise ValueError("not an object with coordinates")
        return tuple({"z": 0.0, **value}.get(axis) for axis in axes)

    def write(numbers: tuple[float, ...]) -> dict[str, float]:
        return {
            axis: round(number, count)
            for axis, number in zip(axes, numbers, strict=True)
        }

    return BeforeValidator(read), PlainSerializer(write)


def _none_if_unreadable(value: object, read: Callable[[object], object]) -> object:
    try:
        return read(value)
    except ValidationError:
        return None


Text = Annotated[str, Strict(), AfterValidator(clean_text)]
Flag = Annotated[bool, Strict()]
Count = Annotated[int, Strict(), Field(ge=0, le=2**53)]
Share = Annotated[float, Strict(), Field(ge=0, le=1), digits(4)]
Metres = Annotated[float, Strict(), Field(ge=-1e6, le=1e6), digits(4)]
Radians = Annotated[float, Strict(), Field(ge=-1e4, le=1e4)]
Speed = Annotated[float, Strict(), Field(ge=-100, le=100), digits(4)]
"""Speed within the bounds of any machine; the profile of a robot bounds it further."""
Seconds = Annotated[float, Strict(), Field(ge=0, le=1e9), digits(4)]
"""Duration of at most thirty years (s)."""
LidarPoints = Annotated[
    list[Annotated[float, Strict(), Field(ge=0, le=MAX_RANGE_M)] | None],
    Field(max_length=MAX_BEAMS),
]
MaxRange = Annotated[float, Strict(), Field(gt=0, le=1e4)]

IN_MESSAGE: Final = "in the message"
"""Mark of a part whose members are members of its message on the wire."""
OR_NONE: Final = WrapValidator(_none_if_unreadable)
"""An unreadable member is None: it never costs the rest of its message."""
IF_ANY: Final = Field(exclude_if=not_)
"""A member that is false or empty is not written."""


class Wire(BaseModel):
    """Base of models of other input than messages of robots."""

    model_config = ConfigDict(
        strict=True, extra="ignore", allow_inf_nan=False, frozen=True
    )
