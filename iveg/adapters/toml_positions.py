"""Positions in a TOML file, for errors that name line and column.

``tomllib`` gives positions of syntax errors alone, in their text.  This finds the rest
line by line: tables, lists of tables, dotted keys, inline tables and lists of them with
a line each, as people write them.
"""

import re
from collections.abc import Iterator
from tomllib import TOMLDecodeError

Path = tuple[str | int, ...]

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


def place_of(text: str, path: Path) -> tuple[int, int]:
    """Line and column, from 1, of what ``path`` names, or of the nearest around it.

    Args:
        text: The file.
        path: Keys, and places in lists of tables, such as ``("robots", 1, "body")``.
    """
    places = _places(text)
    while path and path not in places:
        path = path[:-1]
    return places.get(path, (1, 1))


def _places(text: str) -> dict[Path, tuple[int, int]]:
    found: dict[Path, tuple[int, int]] = {}
    counts: dict[Path, int] = {}
    here: Path = ()
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
    at: Path, lines: Iterator[tuple[int, str]]
) -> Iterator[tuple[Path, tuple[int, int]]]:
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


def _names(dotted: str) -> Path:
    return tuple(part.strip("\"'") for part in _PART.findall(dotted))


def _table(names: Path, counts: dict[Path, int], *, is_list: bool) -> Path:
    """The full path of a header; a list of tables counts its items on."""
    here: Path = ()
    for place, name in enumerate(names):
        here = (*here, name)
        if is_list and place == len(names) - 1:
            counts[here] = counts.get(here, -1) + 1
        if here in counts:
            here = (*here, counts[here])
    return here
