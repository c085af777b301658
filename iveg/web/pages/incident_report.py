"""The page of an incident pack: what happened, in one language, without scripts."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from iveg.domain.records import (
    AlertRecord,
    CommandRecord,
    DecisionRecord,
    LogRecord,
    Record,
)
from iveg.domain.stamps import format_stamp
from iveg.models.history import sentence_of
from iveg.web.pages.sentences import (
    Sentences,
    in_madrid,
    local_stamp,
    read_sentences,
)


@dataclass(frozen=True, slots=True)
class Line:
    """One event: when (Unix s), which kind of row, whose, and what."""

    at: float
    kind: str
    robot_id: str
    text: str

    @property
    def clock(self) -> str:
        """Time of day in Madrid, to the millisecond."""
        return f"{in_madrid(self.at):%H:%M:%S.%f}"[:-3]


def write_report(
    language: str, since: float, until: float, rows: Sequence[Record], said: str
) -> bytes:
    """HTML of all events between two moments (Unix s).

    ``rows`` are decisions, commands, alerts and log; ``said`` is what the pack
    is about, as its manifest has it.
    """
    sentences = read_sentences(language)
    lines = sorted(_lines(rows, sentences), key=lambda one: one.at)
    html = _template().render(
        language=language,
        say=lambda key, **slots: sentences.say(key, slots),
        since=format_stamp(since),
        until=format_stamp(until),
        local_since=local_stamp(since),
        local_until=local_stamp(until),
        day=f"{in_madrid(since):%Y-%m-%d}",
        about=said,
        lines=lines,
    )
    return html.encode()


def _lines(rows: Iterable[Record], sentences: Sentences) -> Iterator[Line]:
    notes: dict[int, Line] = {}
    for row in rows:
        match row:
            case LogRecord(key="log.note"):
                text = sentences.say(row.key, row.slots)
                # It stands at the moment that it is about, and once.
                notes[row.id] = Line(
                    row.slots.get("pinned_at", row.at), "note", row.robot_id or "", text
                )
            case LogRecord():
                text = sentences.say(row.key, row.slots)
                yield Line(row.at, "log", row.robot_id or "", text)
            case AlertRecord():
                text = f"{row.priority} · {sentences.say(row.key, row.slots)}"
                yield Line(row.last_raised_at, "alert", row.robot_id or "", text)
            case DecisionRecord():
                sentence = sentence_of(row)
                text = sentences.say(sentence.key, sentence.slots)
                yield Line(row.started_at, "decision", row.robot_id, text)
            case CommandRecord():
                kind = sentences.say(f"history.kind.{row.kind}", {})
                text = f"{kind} · {row.state} · {row.requested_by}"
                yield Line(row.requested_at, "command", row.robot_id, text)
    yield from notes.values()


@cache
def _template() -> Template:
    folder = str(files("iveg") / "templates")
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, undefined=StrictUndefined
    )
    return environment.get_template("incident.html")
