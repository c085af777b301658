"""TOML files of a checked shape; a complaint names file, line, column, key, reason."""

import tomllib
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from iveg.adapters.toml_positions import Path as TomlPath
from iveg.adapters.toml_positions import place_of, syntax_error
from iveg.domain.errors import DataFileError


class Table(BaseModel):
    """A table of a file; a number may be written without a point, a text is none."""

    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True
    )


T = TypeVar("T", bound=Table)


def read_text(file: str) -> str:
    """The text of a file.

    Raises:
        DataFileError: it cannot be read.
    """
    try:
        return Path(file).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = f"cannot be read as text in UTF-8: {error}."
        raise DataFileError(file, "", reason) from error


def read_table(text: str, file: str, shape: type[T]) -> T:
    """The whole file as a table; ``file`` is its name in complaints.

    Raises:
        DataFileError: it is no TOML, or has another shape.
    """
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line, column, why = syntax_error(error, text)
        reason = f"is not TOML: {why}."
        raise DataFileError(f"{file}:{line}:{column}", "", reason) from error
    try:
        return shape.model_validate(raw)
    except ValidationError as error:
        complaints = error.errors(include_input=False, include_url=False)
        # A key that was mistyped says more than that the right one is missing.
        first = min(complaints, key=lambda one: one["type"] != "extra_forbidden")
        raise complaint(text, file, first["loc"], first["msg"]) from error


def complaint(text: str, file: str, path: TomlPath, reason: str) -> DataFileError:
    """What is wrong with one key of a file."""
    line, column = place_of(text, path)
    key = "".join(f"[{one}]" if isinstance(one, int) else f".{one}" for one in path)
    said = reason.removeprefix("Value error, ")
    return DataFileError(f"{file}:{line}:{column}", key.lstrip("."), f"{said}.")
