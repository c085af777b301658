"""Texts of the page on the server: the same templates that the browser reads.

``iveg/static/i18n/{es,en}.json`` hold nested blocks; a key such as ``nav.live`` walks
down them.  Holes are ``{name}``, ``{name:2}`` (decimals), ``{name:percent}`` and
``{name:who}``; the browser knows further formats, for values that only it ever shows.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Final

LANGUAGES = ("es", "en")
"""Both complete; the first is the one for readers of neither."""

HOLE: Final = re.compile(r"\{(\w+)(?::(\w+))?\}")

Slot = str | int | float


@dataclass(frozen=True, slots=True)
class Translations:
    """All sentences of one language, by key."""

    language: str
    sentences: Mapping[str, str]

    def say(self, key: str, **slots: Slot) -> str:
        """The sentence with its holes filled.

        Raises:
            KeyError: no such sentence; a template of ours is wrong.
        """

        def fill(hole: re.Match[str]) -> str:
            return self._write(slots[hole[1]], hole[2])

        return HOLE.sub(fill, self.sentences[key])

    def _write(self, value: Slot, form: str | None) -> str:
        if form == "who":
            return self.sentences.get(f"who.{value}", str(value))
        if isinstance(value, str) or form is None:
            return str(value)
        if form == "percent":
            return self.percent(value)
        return self.decimal(f"{value:.{int(form)}f}")

    def percent(self, share: float) -> str:
        """A share as browsers write it: Spanish keeps the sign on the number's line."""
        sign = "\u00a0%" if self.language == "es" else "%"
        return f"{100 * share:.0f}{sign}"

    def decimal(self, number: str) -> str:
        """A number with the decimal sign of the language."""
        return number.replace(".", ",") if self.language == "es" else number


def read_translations(language: str) -> Translations:
    """Read the sentences of one of ``LANGUAGES`` from the package."""
    file = files("iveg") / "static" / "i18n" / f"{language}.json"
    blocks = json.loads(file.read_text(encoding="utf-8"))
    return Translations(language, dict(_flatten(blocks)))


def _flatten(blocks: Mapping[str, object], path: str = "") -> Iterator[tuple[str, str]]:
    for name, value in blocks.items():
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{path}{name}.")
        else:
            yield f"{path}{name}", str(value)


def preferred_language(accept: str) -> str:
    """The first of ``LANGUAGES`` in an ``Accept-Language`` header, else Spanish.

    Browsers write the header in the order of preference, so weights are not compared.
    """
    for item in accept.split(","):
        language = item.split(";")[0].strip().lower()[:2]
        if language in LANGUAGES:
            return language
    return LANGUAGES[0]
