"""The words of the page: both languages whole, and every word asked for is there."""

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

from iveg.web.pages.sentences import Sentences, read_sentences

ROOT = Path(__file__).parents[2]
STATIC = ROOT / "iveg/static"
HOLE = re.compile(r"\{(\w+)(?::(\w+))?\}")

_IN_TEMPLATES = re.compile(r"""(?:say|t)\("([a-z][\w.]*\.\w+)"\s*[),]""")
_IN_LABELS = re.compile(r"""label\("[\w-]+", "([\w.]+)"\s*[),]""")
_IN_PYTHON = re.compile(r"""f?"((?:log|alert|health)\.[a-z_.]+)(?<!\.)["{]""")

ES, EN = read_sentences("es"), read_sentences("en")
_BLOCKS = "|".join(sorted({key.partition(".")[0] for key in ES.sentences}))
_IN_SCRIPTS = re.compile(
    rf"""(?<!named\()["`]((?:{_BLOCKS})\.(?!js`)[\w.]*)(["`]|\$)"""
)
_NAMED_IN_SCRIPTS = re.compile(r"""named\("([\w.]+)",""")


def holes(sentence: str) -> set[str]:
    return {name for name, _ in HOLE.findall(sentence)}


def sources(folder: str, *suffixes: str) -> str:
    files = sorted((ROOT / folder).rglob("*"))
    return "\n".join(f.read_text() for f in files if f.suffix in suffixes)


def missing(keys: Iterable[str]) -> list[str]:
    blocks = {
        key.rpartition(".")[0] for key in ES.sentences if key.endswith(".default")
    }
    return sorted({key for key in keys if key not in ES.sentences} - blocks)


def test_both_languages_have_the_same_keys() -> None:
    assert sorted(ES.sentences) == sorted(EN.sentences)


def test_both_languages_fill_the_same_holes() -> None:
    differing = [
        key
        for key in ES.sentences
        if holes(ES.sentences[key]) != holes(EN.sentences[key])
    ]
    assert differing == []


def test_no_key_stands_twice_in_a_file() -> None:
    def once(pairs: list[tuple[str, object]]) -> Mapping[str, object]:
        names = [name for name, _ in pairs]
        assert len(names) == len(set(names)), names
        return dict(pairs)

    for language in ("es", "en"):
        text = (STATIC / f"i18n/{language}.json").read_text()
        json.loads(text, object_pairs_hook=once)


def test_every_word_that_scripts_ask_for_exists() -> None:
    asked = _IN_SCRIPTS.findall(sources("iveg/static/js", ".js"))
    assert len(asked) > 80
    assert missing(key for key, _ in asked if not key.endswith(".")) == []


def test_every_family_of_words_that_scripts_ask_for_exists() -> None:
    scripts = sources("iveg/static/js", ".js")
    asked = _IN_SCRIPTS.findall(scripts)
    families = {key for key, end in asked if end == "$" or key.endswith(".")}
    families |= {f"{block}." for block in _NAMED_IN_SCRIPTS.findall(scripts)}
    known = "\n".join(ES.sentences)
    assert len(families) > 10
    assert [f for f in sorted(families) if not re.search(rf"^{f}", known, re.M)] == []


def test_every_word_that_templates_ask_for_exists() -> None:
    text = sources("iveg/templates", ".html")
    asked = _IN_TEMPLATES.findall(text) + _IN_LABELS.findall(text)
    assert len(asked) > 60
    assert missing(asked) == []


_ANY_NAME = re.compile(r"[a-zA-Z]\w*(?:\.[\w/-]+)+")
_FAMILY = re.compile(
    r"""["'`]([a-z]\w*(?:\.[\w-]*)+)(?:\$?\{|["']\ ~)"""  # then something else
    r"""|named\(\s*"([\w.]+)"|["'`]([a-z]\w*(?:\.\w+)*\.)["'`]"""
)


def test_no_word_is_kept_that_nothing_asks_for() -> None:
    """A family that is asked for by a prefix, as ``log.stop.``, counts as a whole."""
    text = sources("iveg", ".js", ".html", ".py")
    named = set(_ANY_NAME.findall(text))
    families = tuple(
        before or inside or f"{block}."
        for before, block, inside in _FAMILY.findall(text)
        if before or inside or block
    )
    idle = [key for key in ES.sentences if key not in named]
    assert [key for key in idle if not key.startswith(families)] == []


def test_every_sentence_that_the_server_names_exists() -> None:
    text = sources("iveg/vital", ".py") + sources("iveg/comfort", ".py")
    asked = _IN_PYTHON.findall(text)
    assert len(asked) > 10
    known = set(ES.sentences)
    unknown = [
        key
        for key in asked
        if key not in known and not any(one.startswith(f"{key}.") for one in known)
    ]
    assert unknown == []


@pytest.mark.parametrize(
    ("key", "es", "en"),
    [
        ("ready", "PARAR {robot}", "STOP {robot}"),
        ("late", "PARAR {robot} (enlace lento {seconds:0} s)", None),
        ("lost", "SIN ENLACE — use la seta roja del robot", None),
        (
            "kept",
            "NO ENVIADA ({seconds:0} s) — use la seta roja del robot",
            "NOT SENT ({seconds:0} s) — use the red button on the robot",
        ),
        ("asked", "Parando… {ms:0} ms", None),
        ("acknowledged", "Confirmado, frenando…", None),
        ("standing", "PARADO (hace {seconds:1} s)", None),
        ("unconfirmed", "PARADA SIN CONFIRMAR — use la seta roja", None),
        ("still_moving", "SE MUEVE — use la seta roja", None),
        ("stale", "visto parado hace {seconds:0} s: ahora no se sabe", None),
        ("moved", "SE HA MOVIDO — use la seta roja", None),
    ],
)
def test_stop_says_what_the_product_says(key: str, es: str, en: str | None) -> None:
    assert ES.sentences[f"stop.{key}"] == es
    assert en in (None, EN.sentences[f"stop.{key}"])


@pytest.mark.parametrize("texts", [ES, EN], ids=["es", "en"])
def test_line_buttons_and_banners_have_one_sentence_for_the_red_button(
    texts: Sentences,
) -> None:
    todo = texts.sentences["situation.do.red_button"]
    button = todo.removeprefix("use la ").removeprefix("use the ")[:8]
    said = {
        key: text
        for key, text in texts.sentences.items()
        if key.startswith(("stop.", "banner.")) and button in text
    }

    assert len(said) > 10
    assert [key for key, text in said.items() if todo not in text] == []


def test_no_control_is_called_an_emergency_stop() -> None:
    named = [
        key
        for key in ES.sentences
        if "emergenc" in (ES.sentences[key] + EN.sentences[key]).lower()
    ]
    # The honest sentence alone uses the word, to say what STOP is not.
    assert named == ["about.stop"]


def test_numbers_are_written_as_the_reader_writes_them() -> None:
    translations = {"n": "{value:1} m, {share:percent}"}
    assert (
        Sentences("es", translations).say("n", {"value": 1.43, "share": 0.94})
        == "1,4 m, 94\u00a0%"
    )
    assert (
        Sentences("en", translations).say("n", {"value": 1.43, "share": 0.94})
        == "1.4 m, 94%"
    )
