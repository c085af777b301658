"""TOML files of a checked shape; a complaint names file, line, column, key, reason.

Positions in a TOML file, for errors that name line and column.

``tomllib`` gives positions of syntax errors alone, in their text.  This finds the rest
line by line: tables, lists of tables, dotted keys, inline tables and lists of them with
a line each, as people write them.
"""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from tomllib import TOMLDecodeError
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from iveg.domain.errors import DataFileError

KeyPath = tuple[str | int, ...]

_HEADER = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?")
_KEY = re.compile(
    r"""\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')\s*"""
    r"""(?:\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')\s*)*)="""
)
_PART = re.compile(r"""[A-Za-z0-9_-]+|"[^"]*"|'[^']*'""")
_INLINE = re.compile(r"""([A-Za-z0-9_-]+|"[^"]*")\s*=""")
_ITEM = re.compile(r"\s*(\{)")
_SAID = re.compile(r"(.*) \(at line (\d+), column (\d+)\)")


def syntax_error(error: TOMLDecodeError, text: str) -> tuple[int, int, str]:
    """Line and column, from 1, and reason of a syntax error; the end if it is there."""
    found = _SAID.fullmatch(str(error))
    if found is None:
        lines = text.splitlines() or [""]
        return len(lines), len(lines[-1]) + 1, str(error)
    return int(found[2]), int(found[3]), found[1]


def place_of(text: str, path: KeyPath) -> tuple[int, int]:
    """Line and column, from 1, of what ``path`` names, or of the nearest around it.

    Args:
        text: The file.
        path: Keys, and places in lists of tables, such as ``("robots", 1, "body")``.
    """
    places = _places(text)
    while path and path not in places:
        path = path[:-1]
    return places.get(path, (1, 1))


def _places(text: str) -> dict[KeyPath, tuple[int, int]]:
    found: dict[KeyPath, tuple[int, int]] = {}
    counts: dict[KeyPath, int] = {}
    here: KeyPath = ()
    lines = enumerate(text.splitlines(), 1)
    for number, line in lines:
        header = _HEADER.match(line)
        if header is not None:
            names = _names(header[2])
            here = _table(names, counts, is_list=header[1] == "[[")
            found.setdefault(here, (number, header.start(1) + 1))
            continue
        key = _KEY.match(line)
        if key is None:
            continue
        at = here + _names(key[1])
        found.setdefault(at, (number, key.start(1) + 1))
        for inner in _INLINE.finditer(line, key.end()):
            found.setdefault(at + _names(inner[1]), (number, inner.start(1) + 1))
        if line.endswith("["):
            found |= _items(at, lines)
    return found


def _items(
    at: KeyPath, lines: Iterator[tuple[int, str]]
) -> Iterator[tuple[KeyPath, tuple[int, int]]]:
    """The inline tables of a list, up to the line that ends it."""
    index = 0
    for number, line in lines:
        item = _ITEM.match(line)
        if item is not None:
            yield (*at, index), (number, item.start(1) + 1)
            for key in _INLINE.finditer(line):
                yield (*at, index, *_names(key[1])), (number, key.start(1) + 1)
            index += 1
        if line.endswith("]"):
            return


def _names(dotted: str) -> KeyPath:
    return tuple(part.strip("\"'") for part in _PART.findall(dotted))


def _table(names: KeyPath, counts: dict[KeyPath, int], *, is_list: bool) -> KeyPath:
    """The full path of a header; a list of tables counts its items on."""
    here: KeyPath = ()
    for place, name in enumerate(names):
        here = (*here, name)
        if is_list and place == len(names) - 1:
            counts[here] = counts.get(here, -1) + 1
        if here in counts:
            here = (*here, counts[here])
    return here


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


def complaint(text: str, file: str, path: KeyPath, reason: str) -> DataFileError:
    """What is wrong with one key of a file."""
    line, column = place_of(text, path)
    key = "".join(f"[{one}]" if isinstance(one, int) else f".{one}" for one in path)
    said = reason.removeprefix("Value error, ")
    return DataFileError(f"{file}:{line}:{column}", key.lstrip("."), f"{said}.")
