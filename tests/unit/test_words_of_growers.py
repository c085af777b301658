"""Issue 13.16, 13.20: sentences are in a grower's words, in both languages."""

import re

import pytest

from iveg.web.pages.sentences import read_sentences

INSIDE = ("error",)
"""Pages for programmers, and codes of HTTP."""


def sentences(language: str) -> dict[str, str]:
    found = read_sentences(language).sentences
    return {key: text for key, text in found.items() if key.split(".")[0] not in INSIDE}


@pytest.mark.parametrize("language", ["es", "en"])
def test_no_sentence_shows_a_name_from_inside(language: str) -> None:
    names = re.compile(
        r"\bULID\b|\bnone\b\W*$|\bnull\b|challenge|\{(?:decision|hold)\}"
    )

    assert [k for k, text in sentences(language).items() if names.search(text)] == []


@pytest.mark.parametrize(
    ("language", "one", "others"),
    [
        ("es", "zona", r"círculo que|\banillo\b"),
        ("en", "zone", r"\bring\b"),
        ("es", "aparato", r"este (?:equipo|dispositivo)|Según el equipo"),
        ("es", "certeza", r"\bconfianza\b"),
        ("en", "certainty", r"\bconfidence\b"),
        ("es", "alerta", r"\b[Aa]larma"),
        ("en", "alert", r"\b[Aa]larm"),
        ("es", "archivo", r"\bfichero"),
        ("es", "destino", r"\bmeta\b"),
        ("es", "datos recientes", r"\binforme\b.* no es reciente"),
        ("en", "recent data", r"\bnot fresh\b"),
        ("en", "orders", r"\bCommands\b"),
    ],
)
def test_13_20_one_thing_has_one_word(language: str, one: str, others: str) -> None:
    told = sentences(language).items()
    known = {key: re.sub(r"\{[^}]*\}", "", text) for key, text in told}

    assert [key for key, text in known.items() if re.search(others, text)] == []
    assert any(one in text.lower() for text in known.values())


@pytest.mark.parametrize("language", ["es", "en"])
def test_28_10_whoever_did_something_and_what_was_seen_are_translated(
    language: str,
) -> None:
    raw = re.compile(r"\{(?:by|who|class|class_id|requested_by)\}")
    # Recipients, as somebody typed them; and a label that nothing translates.
    names = ("messages.", "log.detection_unmapped")

    told = sentences(language).items()

    assert [k for k, t in told if raw.search(t) and not k.startswith(names)] == []
