"""Each row of ``docs/paper.md`` names code and tests that exist, or says why not."""

from tests.architecture import documents

_PAGE = (documents.DOCS / "paper.md").read_text()
_HEAD = ["the paper", "code", "test", "difference"]
ROWS = documents.rows(_PAGE, _HEAD)


def test_the_page_has_every_part_of_the_paper() -> None:
    assert len(ROWS) > 50
    assert [row for row in ROWS if len(row) != len(_HEAD)] == []


def test_every_place_that_the_page_names_exists() -> None:
    assert documents.lost_places(_PAGE) == []


def test_every_row_has_code_and_a_test_or_says_why_not() -> None:
    wanting = [
        said
        for said, code, test, difference in ROWS
        if not (documents.PLACE.search(code) and "`tests/" in test)
        and not difference.startswith("not here: ")
    ]

    assert wanting == []


def test_code_is_code_and_tests_are_tests() -> None:
    code = [name for row in ROWS for name, _ in documents.PLACE.findall(row[1])]
    tests = [name for row in ROWS for name, _ in documents.PLACE.findall(row[2])]

    assert [name for name in code if name.startswith("tests/")] == []
    assert [name for name in tests if not name.startswith("tests/")] == []
