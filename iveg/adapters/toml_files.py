"""TOML files of a checked shape; a complaint names file, key and reason."""

import tomllib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from iveg.domain.errors import DataFileError

KeyPath = tuple[str | int, ...]
"""Keys, and places in lists of tables, such as ``("robots", 1, "body")``."""


class Table(BaseModel):
    """A table of a file; a number may be written without a point, a text is none."""

    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True
    )


T = TypeVar("T", bound=Table)


def read_text(file: str, own: Mapping[str, str] | None = None) -> str:
    """The text of a file.

    Args:
        file: Its path, or the name of one of iVeg's own.
        own: Those, by name: their place in ``iveg/data``.

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
        # A key that was mistyped says more than that the right one is missing.
        first = min(complaints, key=lambda one: one["type"] != "extra_forbidden")
        raise complaint(file, first["loc"], first["msg"]) from error


def complaint(file: str, path: KeyPath, reason: str) -> DataFileError:
    """The error that one key of a file is wrong."""
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    said = reason.removeprefix("Value error, ")
    return DataFileError(file, key.lstrip("."), f"{said}.")
