"""Each row of ``docs/threats.md`` names a test that exists, or says why not."""

from tests.architecture import documents

_PAGE = (documents.DOCS / "threats.md").read_text()
_KINDS = set("STRIDE")
ROWS = documents.rows(_PAGE, ["threat", "kind", "answer", "test"])


def test_each_hop_has_its_threats_and_all_kinds_are_answered() -> None:
    assert len(ROWS) > 25
    assert [row for row in ROWS if len(row) != 4] == []
    assert set().union(*({*kind.split(", ")} for _, kind, _, _ in ROWS)) == _KINDS


def test_every_place_that_the_page_names_exists() -> None:
    assert documents.lost_places(_PAGE) == []


def test_every_threat_has_a_test_or_says_why_not() -> None:
    wanting = [
        threat
        for threat, _, answer, test in ROWS
        if "`tests/" not in test and not answer.startswith("not here: ")
    ]

    assert wanting == []
