"""Incident packs over HTTP: all data about some minutes, as one ZIP.

A page, the recording, the rows of the history, every version of the rule and the
settings without secrets (docs/interfaces/recordings.md, "Incident packs").
"""

import asyncio
import shutil
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, HTTPException, Query, Request
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from iveg.adapters.history import lists
from iveg.adapters.history.lists import MOST_ROWS, Filter, ListOf
from iveg.adapters.history.queries import Queries
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.worker import Worker
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import HopError
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.records import (
    AlertRecord,
    CommandRecord,
    DecisionRecord,
    LogRecord,
    Record,
)
from iveg.domain.stamps import format_stamp
from iveg.models.history import sentence_of
from iveg.models.rule import Rule
from iveg.vital.ports import Clock
from iveg.web.api.history_filters import RecordId, Span
from iveg.web.pages.drawing import appearance_of, environment_of
from iveg.web.pages.sentences import Sentences, in_madrid, local_stamp, read_sentences
from iveg.web.security.requirements import Operator

MEDIA_TYPE = "application/zip"
LONGEST_S, BEFORE_S, AFTER_S = 3600.0, 30.0, 30.0
_About = tuple[str, float, float, str]
"""Language of the page, since, until (Unix s), and subject of the pack."""


class About(Span):
    """Subject of a pack: a range, or a record with the minutes around it."""

    decision: RecordId | None = None
    command: RecordId | None = None
    alert: RecordId | None = None


@dataclass(frozen=True, slots=True)
class Sources:
    """Sources of the parts of a pack.

    Attributes:
        rules: Every version of the rule, oldest first.
        settings: Settings without secrets, by variable.
        log: Writes a line into the log.
        version: Version of iVeg.
    """

    queries: Queries
    recordings: InputRecorder
    worker: Worker
    rules: Callable[[], Sequence[DetectionRule]]
    settings: Mapping[str, str]
    log: Callable[[LogEvent, Instant], None]
    clock: Clock
    version: str


def router(sources: Sources) -> APIRouter:
    """The route of incident packs."""
    routes = APIRouter(prefix="/api/v1", tags=["history"])

    @routes.get(
        "/incident",
        response_class=FileResponse,
        responses={200: {"content": {MEDIA_TYPE: {}}}},
    )
    async def incident(
        subject: Annotated[About, Query()],
        principal: Operator,
        request: Request,
    ) -> FileResponse:
        """Everything about some minutes as a ZIP, at most an hour."""
        since, until, title = await _range(subject, sources)
        now = sources.clock().wall
        if since > now:
            raise HTTPException(422, "That range is still to come.")
        # The pack's end must not claim minutes that are still to come.
        until = min(until, now)
        folder = Path(await asyncio.to_thread(tempfile.mkdtemp, prefix="iveg-pack-"))
        clear = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
        try:
            language = appearance_of(request).language
            await _pack(sources, folder, (language, since, until, title))
        # Also after a cancelled request: the folder holds people's places.
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        slots = {"by": principal.name, "about": title}
        sources.log(LogEvent("system", "log.incident_packed", slots), sources.clock())
        name = f"incident-{format_stamp(since)[:19].replace(':', '-')}Z.zip"
        return FileResponse(
            folder / "pack.zip", media_type=MEDIA_TYPE, filename=name, background=clear
        )

    return routes


async def _range(subject: About, sources: Sources) -> tuple[float, float, str]:
    """Since, until (Unix s), and subject of a pack."""
    rows: dict[str, tuple[ListOf[Any], str]] = {
        "decision": (lists.DECISIONS, "ended_at"),
        "command": (lists.COMMANDS, "standing_at"),
        "alert": (lists.ALERTS, "cleared_at"),
    }
    for kind, (table, ends) in rows.items():
        identifier = getattr(subject, kind)
        if identifier is None:
            continue
        record = await sources.queries.get(table, identifier)
        if record is None:
            raise HTTPException(404, f"There is no such {kind}.")
        began = getattr(record, table.at.name)
        # A record that goes on has no end yet: its begin counts.
        since, ended = began - BEFORE_S, getattr(record, ends) or began
        return since, min(ended + AFTER_S, since + LONGEST_S), f"{kind} {identifier}"
    if subject.since is None or subject.until is None:
        raise HTTPException(
            422, "Name a decision, a command, an alert, or since and until."
        )
    since, until = subject.since.timestamp(), subject.until.timestamp()
    if until - since > LONGEST_S:
        raise HTTPException(422, "A pack holds an hour at most.")
    return since, until, "range"


async def _pack(sources: Sources, folder: Path, about: _About) -> None:
    """Write ``pack.zip``."""
    _, since, until, title = about
    messages = await sources.recordings.excerpt(folder / "recording.mcap", since, until)
    facts = {
        "iveg": sources.version,
        "made_at": format_stamp(sources.clock().wall),
        "about": title,
        "since": format_stamp(since),
        "until": format_stamp(until),
        "messages": messages,
        "rules": [
            Rule.from_rule(rule).model_dump(mode="json") for rule in sources.rules()
        ],
        "settings": dict(sources.settings),
    }
    rows = await _rows(sources.queries, since, until)
    await sources.worker.run(_write, folder, about, facts, rows)


async def _rows(
    queries: Queries, since: float, until: float
) -> dict[str, list[Record]]:
    """Rows of the history by list, oldest first."""
    parts: dict[str, ListOf[Any]] = {
        "decisions": lists.DECISIONS,
        "commands": lists.COMMANDS,
        "alerts": lists.ALERTS,
        "log": lists.LOG,
        "detections": lists.DETECTIONS,
        "odometry": lists.ODOMETRY,
    }
    span = Filter(since=since, until=until, limit=MOST_ROWS)
    by_list = {
        name: (await queries.rows(rows, span))[::-1] for name, rows in parts.items()
    }
    # A note is about a moment before it was written.
    later = await queries.rows(lists.NOTES, Filter(since=since, limit=MOST_ROWS))
    by_list["notes"] = [
        note for note in reversed(later) if since <= _moment_of(note) < until
    ]
    return by_list


def _is_note(row: Record) -> bool:
    return isinstance(row, LogRecord) and row.key == "log.note"


def _moment_of(line: LogRecord) -> float:
    """Moment that a line of the log describes (Unix s)."""
    return float(line.slots.get("pinned_at", line.at))


def _write(
    folder: Path,
    about: _About,
    facts: Mapping[str, object],
    rows: Mapping[str, Sequence[Record]],
) -> None:
    """Write the pack, in the worker's process."""
    language, since, until, title = about
    # A note stands once, at the moment that it describes.
    log = [row for row in rows["log"] if not _is_note(row)]
    names = ("decisions", "commands", "alerts", "notes")
    events = [*log, *(row for name in names for row in rows[name])]
    try:
        with zipfile.ZipFile(folder / "pack.zip", "w", zipfile.ZIP_DEFLATED) as pack:
            pack.writestr(
                "report.html", write_report(language, since, until, events, title)
            )
            pack.writestr("about.json", orjson.dumps(facts, option=orjson.OPT_INDENT_2))
            for name, records in rows.items():
                lines = (orjson.dumps(asdict(row)) + b"\n" for row in records)
                pack.writestr(f"rows/{name}.ndjson", b"".join(lines))
            pack.write(folder / "recording.mcap", "recording.mcap")
    except OSError as error:
        raise HopError("disk", error.strerror or str(error)) from error


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the report: moment (Unix s), kind of row, robot, sentence."""

    at: float
    kind: str
    robot_id: str
    text: str

    @property
    def clock(self) -> str:
        """Time of day in Madrid, to the millisecond."""
        return f"{in_madrid(self.at):%H:%M:%S.%f}"[:-3]


def write_report(
    language: str, since: float, until: float, rows: Sequence[Record], title: str
) -> bytes:
    """HTML of all events between two moments (Unix s).

    ``rows`` are decisions, commands, alerts and log; ``title`` is the subject of the
    pack, as in its manifest.
    """
    sentences = read_sentences(language)
    lines = sorted(_lines(rows, sentences), key=lambda line: line.at)
    template = environment_of(sentences).get_template("incident.html")
    html = template.render(
        language=language,
        since=format_stamp(since),
        until=format_stamp(until),
        local_since=local_stamp(since),
        local_until=local_stamp(until),
        day=f"{in_madrid(since):%Y-%m-%d}",
        about=title,
        lines=lines,
    )
    return html.encode()


def _lines(rows: Iterable[Record], sentences: Sentences) -> Iterator[Line]:
    for row in rows:
        match row:
            case LogRecord():
                kind = "note" if _is_note(row) else "log"
                text = sentences.say(row.key, row.slots)
                yield Line(_moment_of(row), kind, row.robot_id or "", text)
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
