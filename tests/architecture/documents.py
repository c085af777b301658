"""The pages of ``docs/`` as tests read them: headings, sections, tables."""

import re
from collections.abc import Iterator
from pathlib import Path

from tests.processes import ROOT

DOCS = ROOT / "docs"
INTERFACES = DOCS / "interfaces"
PLACE = re.compile(r"`((?:iveg|tests|docs)/[\w./-]+)(?:::([\w.]+))?`")
"""A file in a cell, with the name in it that is meant."""


def interfaces() -> str:
    """All pages of the contract as one text."""
    return "\n".join(page.read_text() for page in sorted(INTERFACES.glob("*.md")))


def headings(text: str) -> list[str]:
    """The titles of a page, without their marks."""
    return [title.strip() for _, title in _titles(text)]


def named_headings(text: str) -> set[str]:
    """Names in code that stand in a title, such as a route or a topic."""
    return {name for title in headings(text) for name in re.findall(r"`(.+?)`", title)}


def section(text: str, title: str) -> str:
    """What stands below a title, down to the next of its level or above.

    Raises:
        KeyError: the page has no such title.
    """
    lines = text.splitlines()
    for number, (level, found) in _numbered(text):
        if found.strip() == title:
            ends = (n for n, (deep, _) in _numbered(text) if n > number)
            last = next(
                (n for n in ends if len(_level(lines[n])) <= len(level)), len(lines)
            )
            return "\n".join(lines[number + 1 : last])
    raise KeyError(title)


def keys(text: str) -> list[str]:
    """Names in code in the first cells of all tables, in their order."""
    rows = re.findall(r"^\| (.+?) \|", text, re.M)
    return [name for cell in rows for name in re.findall(r"`(.+?)`", cell)]


def pages() -> list[Path]:
    """Every page that people read, the repository's own included."""
    return [*sorted(DOCS.rglob("*.md")), *sorted(ROOT.glob("*.md"))]


def _level(line: str) -> str:
    return line.partition(" ")[0]


def _titles(text: str) -> Iterator[tuple[str, str]]:
    return (title for _, title in _numbered(text))


def _numbered(text: str) -> Iterator[tuple[int, tuple[str, str]]]:
    is_code = False
    for number, line in enumerate(text.splitlines()):
        is_code ^= line.startswith("```")
        found = re.match(r"(#+) (.*)", line)
        if found and not is_code:
            yield number, (found[1], found[2])


def rows(page: str, head: list[str]) -> list[list[str]]:
    """The cells of each row of each table with these heads, heads left out."""
    cells = [
        [cell.strip() for cell in line.strip("|").split(" | ")]
        for line in page.splitlines()
        if line.startswith("| ")
    ]
    return [row for row in cells if row != head]


def lost_places(page: str) -> list[tuple[str, str]]:
    """Files, and names in them, that a page tells of and nobody finds."""
    return [
        (name, symbol)
        for name, symbol in PLACE.findall(page)
        if not (ROOT / name).is_file() or (symbol and not _defines(ROOT / name, symbol))
    ]


def _defines(path: Path, name: str) -> bool:
    defined = rf"^\s*(?:async )?(?:def|class) {name}\b|^{name}\b.* = "
    return re.search(defined, path.read_text(), re.M) is not None
