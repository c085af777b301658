"""Each row of ``docs/paper.md`` names code and tests that exist, or says why not."""

import re
from collections.abc import Iterator
from pathlib import Path

from tests.architecture import documents
from tests.processes import ROOT

_PAGE = (documents.DOCS / "paper.md").read_text()
_PLACE = re.compile(r"`((?:iveg|tests|docs)/[\w./-]+)(?:::([\w.]+))?`")
_HEAD = ["the paper", "code", "test", "difference"]


def _rows() -> Iterator[list[str]]:
    """The cells of each row of each table, heads left out."""
    for line in _PAGE.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if line.startswith("| ") and cells != _HEAD:
            yield [cell.strip() for cell in cells]


ROWS = list(_rows())


def _defines(path: Path, name: str) -> bool:
    defined = rf"^\s*(?:async )?(?:def|class) {name}\b|^{name}\b.* = "
    return re.search(defined, path.read_text(), re.M) is not None


def test_the_page_has_every_part_of_the_paper() -> None:
    assert len(ROWS) > 50
    assert [row for row in ROWS if len(row) != len(_HEAD)] == []


def test_every_place_that_the_page_names_exists() -> None:
    lost = [
        (name, symbol)
        for name, symbol in _PLACE.findall(_PAGE)
        if not (ROOT / name).is_file() or (symbol and not _defines(ROOT / name, symbol))
    ]

    assert lost == []


def test_every_row_has_code_and_a_test_or_says_why_not() -> None:
    wanting = [
        said
        for said, code, test, difference in ROWS
        if not (_PLACE.search(code) and "`tests/" in test)
        and not difference.startswith("not here: ")
    ]

    assert wanting == []


def test_code_is_code_and_tests_are_tests() -> None:
    code = [name for row in ROWS for name, _ in _PLACE.findall(row[1])]
    tests = [name for row in ROWS for name, _ in _PLACE.findall(row[2])]

    assert [name for name in code if name.startswith("tests/")] == []
    assert [name for name in tests if not name.startswith("tests/")] == []
