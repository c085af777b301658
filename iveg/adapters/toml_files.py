"""TOML files of a checked shape; a complaint names file, key and reason."""

import tomllib
from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path
from typing import TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from iveg.domain.errors import DataFileError

KeyPath = tuple[str | int, ...]
"""Keys, and places in lists of tables, such as ``("robots", 1, "body")``."""


class Table(BaseModel):
    """Table of a file; an integer may stand for a number, a text may not."""

    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True
    )


T = TypeVar("T", bound=Table)


def must(holds: Callable[[str], bool], complaint: str) -> AfterValidator:
    """Refuse a text that fails a condition; ``{}`` in the complaint is the text."""

    def checked(text: str) -> str:
        if not holds(text):
            raise ValueError(complaint.format(text))
        return text

    return AfterValidator(checked)


def read_text(file: str, own: Mapping[str, str] | None = None) -> str:
    """The text of a file.

    Args:
        file: Its path, or the name of a built-in file.
        own: Built-in files by name, with their paths in ``iveg/data``.

    Raises:
        DataFileError: it cannot be read.
    """
    try:
        if own and file in own:
            return (resources.files("iveg") / "data" / own[file]).read_text("utf-8")
        return Path(file).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        known = f"; iVeg's own are {', '.join(own)}" if own else ""
        reason = f"cannot be read as text in UTF-8: {error}{known}."
        raise DataFileError(file, "", reason) from error


def read_table(text: str, file: str, shape: type[T]) -> T:
    """The whole file as a table; ``file`` is its name in complaints.

    Raises:
        DataFileError: it is no TOML, or has another shape.
    """
    try:
        return shape.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise DataFileError(file, "", f"is not TOML: {error}.") from error
    except ValidationError as error:
        complaints = error.errors(include_input=False, include_url=False)
        # A mistyped key explains more than the complaint that the right one is missing.
        first = min(complaints, key=lambda item: item["type"] != "extra_forbidden")
        raise complaint(file, first["loc"], first["msg"]) from error


def complaint(file: str, path: KeyPath, reason: str) -> DataFileError:
    """Error for a wrong key of a file."""
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    # pydantic puts these words before the text of a validator of ours.
    text = reason.removeprefix("Value error, ")
    return DataFileError(file, key.lstrip("."), f"{text}.")
