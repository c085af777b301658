"""Sentences for files and paper are those of the page."""

import pytest

from iveg.web.pages.sentences import in_madrid, read_sentences

ES, EN = read_sentences("es"), read_sentences("en")


def test_formats_are_those_of_the_page() -> None:
    slots = {"robot": "AGII", "factor": 0.5, "reason": "person"}

    assert EN.say("log.speed_down.default", slots) == (
        "AGII · Speed → 50% (person near)"
    )
    assert ES.decimal("1.43") == "1,43"
    assert ES.say("rows.by", {"by": "operator"}) == "operador"
    assert EN.say("rows.by", {"by": "Ana"}) == "Ana"
    assert ES.lane("Cabecera norte") == "Cabecera norte"
    assert EN.lane("Pasillo 3") == "Aisle 3"
    assert EN.lane("Tomates de Ana") == "Tomates de Ana"


def test_what_is_unknown_is_a_dash_and_an_unknown_sentence_its_key() -> None:
    assert "—" in EN.say("log.speed_down.default", {"robot": "AGII"})
    assert EN.say("log.of_another_version.x", {}) == "log.of_another_version.x"


@pytest.mark.parametrize(
    ("utc", "wall"),
    [
        (1_774_746_000.0 - 1.0, "2026-03-29 01:59:59"),
        (1_774_746_000.0, "2026-03-29 03:00:00"),
        (1_792_890_000.0 - 1.0, "2026-10-25 02:59:59"),
        (1_792_890_000.0, "2026-10-25 02:00:00"),
    ],
)
def test_clocks_change_when_those_of_madrid_do(utc: float, wall: str) -> None:
    assert f"{in_madrid(utc):%Y-%m-%d %H:%M:%S}" == wall
