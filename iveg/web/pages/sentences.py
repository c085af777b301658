"""Sentences for files and paper, as the page writes them: templates, slots, formats.

The formats are those of ``static/js/core/messages.js``; a missing template shows its
key, so that a row of an older version is never lost.
"""

import re
from collections.abc import Mapping
from typing import Final

from iveg.web.pages.local_time import in_madrid
from iveg.web.pages.translations import HOLE, Translations

_TRACK = re.compile(r"([PR])(\d+)(?:-[0-9a-f]+)?")
_NOTHING: Final = "—"
_NAMED: Final = {
    "class": "class",
    "a": "class.a",
    "who": "who",
    "why": "why",
    "hop": "hop",
    "part": "part",
    "doubt": "doubt",
}
_LANES: Final = (
    (re.compile(r"(?:Pasillo )?(\d+)"), "lane.number"),
    (re.compile(r"Pasillo (\d+) norte"), "lane.number_north"),
    (re.compile(r"Pasillo (\d+) sur"), "lane.number_south"),
    (re.compile(r"Pasillo central"), "lane.central"),
    (re.compile(r"Cabecera norte"), "lane.end_north"),
    (re.compile(r"Cabecera sur"), "lane.end_south"),
)

Slots = Mapping[str, object]


class Sentences:
    """Writes events as sentences in one language."""

    def __init__(self, translations: Translations) -> None:
        self.translations = translations

    def say(self, key: str, slots: Slots) -> str:
        """A sentence with its holes filled."""
        template = self._find(key)
        if template is None:
            return key
        return HOLE.sub(
            lambda hole: self._write(slots.get(hole[1]), hole[2], slots), template
        ).strip()

    def lane(self, label: str) -> str:
        """An aisle in the reader's words; a name that a grower gave stays."""
        for form, key in _LANES:
            found = form.fullmatch(label)
            if found:
                return self.say(key, {"n": "".join(found.groups())})
        return label

    def _find(self, key: str) -> str | None:
        sentences, head = self.translations.sentences, key.rpartition(".")[0]
        for one in (key, f"{head}.default", f"{key}.default"):
            if one in sentences:
                return sentences[one]
        return None

    def _write(self, value: object, form: str | None, slots: Slots) -> str:
        if value is None or value == "":
            return _NOTHING
        if form == "sentence":
            return self._sentence(value, slots)
        if form == "person":
            return self._person(str(value))
        if form == "own":
            # What the grower calls it in this language, as the equipment's file says.
            return str(slots.get(f"tile_{self.translations.language}", value))
        if form == "lane":
            return self.lane(str(value))
        if form in _NAMED:
            key = f"{_NAMED[form]}.{value}"
            return self.translations.sentences.get(key, str(value))
        if isinstance(value, bool) or not isinstance(value, int | float):
            return str(value)
        return self._measure(float(value), form)

    def _measure(self, value: float, form: str | None) -> str:
        if form == "percent":
            return self.translations.percent(value)
        if form == "time":
            return f"{in_madrid(value):%H:%M:%S}"
        decimals = int(form) if form and form.isdigit() else 3
        text = self.translations.decimal(f"{value:.{decimals}f}")
        return text if form else _trimmed(text)

    def _person(self, track: str) -> str:
        found = _TRACK.fullmatch(track)
        if found:
            return self.say(f"class.track.{found[1]}", {"n": found[2]})
        return self.translations.sentences.get(f"class.{track}", track)

    def _sentence(self, value: object, slots: Slots) -> str:
        if isinstance(value, Mapping):
            key, slots = str(value.get("key")), value.get("slots") or slots
        else:
            key = str(value)
        return self.say(key if key.startswith("alert.") else f"alert.{key}", slots)


def _trimmed(text: str) -> str:
    return text.rstrip("0").rstrip(".,") if "." in text or "," in text else text
