"""Texts and clock of the greenhouse on the server, as the page has them.

``iveg/static/i18n/{es,en}.json`` hold nested blocks; a key such as ``nav.live`` walks
down them.  Holes are ``{name}`` or ``{name:format}``; formats are those of
``static/js/core/messages.js``.  Paper and screen show Central European time, with the
summer time of Directive 2000/84/EC, so that no table of time zones must be installed.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from importlib.resources import files
from typing import Final

from iveg.comfort.messenger import Write
from iveg.domain.events import AlertItem, Language, MessageText

_HOUR = timedelta(hours=1)


def in_madrid(at: float) -> datetime:
    """A moment (Unix s) as Madrid's time; the value holds no time zone."""
    moment = datetime.fromtimestamp(at, UTC).replace(tzinfo=None)
    return moment + (2 * _HOUR if _is_summer(moment) else _HOUR)


def local_stamp(at: float) -> str:
    """A moment (Unix s) as Madrid's time, to the second."""
    return f"{in_madrid(at):%Y-%m-%d %H:%M:%S}"


def start_of(day: date) -> float:
    """Begin of a day in Madrid (Unix s); clocks never change at midnight."""
    midnight = datetime(day.year, day.month, day.day)  # noqa: DTZ001 - a wall clock
    offset_s = 2 * _HOUR if _is_summer(midnight - _HOUR) else _HOUR
    return (midnight - offset_s).replace(tzinfo=UTC).timestamp()


def _is_summer(moment: datetime) -> bool:
    """From the last Sunday of March to that of October, both at 01:00 UTC."""
    return _last_sunday(moment.year, 3) <= moment < _last_sunday(moment.year, 10)


def _last_sunday(year: int, month: int) -> datetime:
    last = datetime(year, month, 31, 1)  # noqa: DTZ001 - UTC, as its callers have it
    return last - timedelta(days=(last.weekday() + 1) % 7)


LANGUAGES = ("es", "en")
"""Both are complete; the first is for readers of neither."""

HOLE: Final = re.compile(r"\{(\w+)(?::(\w+))?\}")


def preferred_language(accept: str) -> str:
    """The first of ``LANGUAGES`` in an ``Accept-Language`` header, else Spanish.

    Browsers write the header in the order of preference, so weights are not compared.
    """
    for item in accept.split(","):
        language = item.split(";")[0].strip().lower()[:2]
        if language in LANGUAGES:
            return language
    return LANGUAGES[0]


# The suffix only keeps ids apart over days; people say the number.
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
    "parameter": "rule.part",
    "class_of": "rule.class",
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


@dataclass(frozen=True, slots=True)
class Sentences:
    """All sentences of one language, by key."""

    language: str
    sentences: Mapping[str, str]

    def say(self, key: str, slots: Slots) -> str:
        """A sentence with its holes filled.

        Without a sentence it is the key, so that rows of older versions are never lost.
        """
        head = key.rpartition(".")[0]
        for name in (key, f"{head}.default", f"{key}.default"):
            if name in self.sentences:
                return HOLE.sub(
                    lambda hole: self._write(slots.get(hole[1]), hole[2], slots),
                    self.sentences[name],
                ).strip()
        return key

    def percent(self, share: float) -> str:
        """A share as browsers write it: Spanish keeps the sign on the number's line."""
        return f"{100 * share:.0f}" + ("\u00a0%" if self.language == "es" else "%")

    def decimal(self, number: str) -> str:
        """A number with the decimal sign of the language."""
        return number.replace(".", ",") if self.language == "es" else number

    def lane(self, label: str) -> str:
        """An aisle in the reader's words; a name that a grower gave stays."""
        for form, key in _LANES:
            match = form.fullmatch(label)
            if match:
                return self.say(key, {"n": "".join(match.groups())})
        return label

    def _write(self, value: object, form: str | None, slots: Slots) -> str:
        if value is None or value == "":
            return _NOTHING
        if form == "sentence":
            return self._sentence(value, slots)
        if form == "person":
            return self._person(str(value))
        if form == "own":
            # The grower's name for it in this language, from the equipment file.
            return str(slots.get(f"tile_{self.language}", value))
        if form == "lane":
            return self.lane(str(value))
        if form in _NAMED:
            return self.sentences.get(f"{_NAMED[form]}.{value}", str(value))
        # Python counts True as a number.
        if isinstance(value, bool) or not isinstance(value, int | float):
            return str(value)
        return self._measure(float(value), form)

    def _measure(self, value: float, form: str | None) -> str:
        if form == "percent":
            return self.percent(value)
        if form == "time":
            return f"{in_madrid(value):%H:%M:%S}"
        decimals = int(form) if form and form.isdigit() else 3
        text = self.decimal(f"{value:.{decimals}f}")
        return text if form else _trimmed(text)

    def _person(self, track: str) -> str:
        match = _TRACK.fullmatch(track)
        if match:
            return self.say(f"class.track.{match[1]}", {"n": match[2]})
        return self.sentences.get(f"class.{track}", track)

    def _sentence(self, value: object, slots: Slots) -> str:
        if isinstance(value, Mapping):
            key, slots = str(value.get("key")), value.get("slots") or slots
        else:
            key = str(value)
        return self.say(key if key.startswith("alert.") else f"alert.{key}", slots)


def _trimmed(text: str) -> str:
    return text.rstrip("0").rstrip(".,") if "." in text or "," in text else text


def read_sentences(language: str) -> Sentences:
    """Read the sentences of one of ``LANGUAGES`` from the package."""
    file = files("iveg") / "static" / "i18n" / f"{language}.json"
    blocks = json.loads(file.read_text(encoding="utf-8"))
    return Sentences(language, dict(_flatten(blocks)))


def _flatten(blocks: Mapping[str, object], path: str = "") -> Iterator[tuple[str, str]]:
    for name, value in blocks.items():
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{path}{name}.")
        else:
            yield f"{path}{name}", str(value)


def writer(language: Language) -> Write:
    """Writer of messages in a language: priority and time, no place and no person."""
    sentences = read_sentences(language)

    def write(items: Sequence[AlertItem], is_escalated: bool) -> MessageText:
        slots = {
            "priority": min(item.priority for item in items),
            "count": len(items),
            "at": min(item.raised.wall for item in items),
        }
        title = "messages.title_unseen" if is_escalated else "messages.title"
        body = "messages.body_one" if len(items) == 1 else "messages.body_more"
        return MessageText(sentences.say(title, slots), sentences.say(body, slots))

    return write
