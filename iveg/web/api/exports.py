"""Lists as files: CSV for spreadsheets, NDJSON for programs.

A CSV in a reader's language is one that Excel opens with a double click: a byte order
mark, the separator and decimals of the language, and each event as a sentence.

An export runs through every page of a list while it is sent, so that a month of rows is
never held in memory.
"""

import codecs
import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Literal, TypeVar

from starlette.datastructures import Headers

from iveg.domain.records import (
    SHOWN_COLUMNS,
    AlertRecord,
    Column,
    DecisionRecord,
    LogRecord,
    Record,
)
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, write_json
from iveg.models.history import sentence_of
from iveg.web.pages.sentences import Sentences

Form = Literal["json", "csv", "ndjson"]
MEDIA_TYPES: dict[Form, str] = {
    "json": "application/json",
    "csv": "text/csv",
    "ndjson": "application/x-ndjson",
}
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
R = TypeVar("R", bound=Record)
_Spoken = LogRecord | AlertRecord | DecisionRecord
"""Rows with a sentence; the others are numbers alone."""


def form_of(headers: Headers) -> Form:
    """The form that the ``Accept`` header names first; JSON without one."""
    accepted = headers.get("accept", "").lower()
    named = [
        (accepted.index(media_type), form)
        for form, media_type in MEDIA_TYPES.items()
        if media_type in accepted
    ]
    return min(named)[1] if named else "json"


def csv_head(kind: type[R], reader: Sentences | None = None) -> bytes:
    """The first line of rows as CSV (RFC 4180), one column a field of the record.

    Args:
        kind: Of the rows.
        reader: Its spreadsheet has words and decimals of its language; None: programs.
    """
    head = [one.name for one in SHOWN_COLUMNS[kind]]
    if reader is None:
        return csv_lines([head])
    if issubclass(kind, _Spoken):
        head = [reader.say("export.sentence", {}), *head]
    return codecs.BOM_UTF8 + csv_lines([head], reader)


def csv_rows(
    kind: type[R], records: Iterable[R], reader: Sentences | None = None
) -> bytes:
    """Rows below that line, times in UTC."""
    rows = []
    for record in records:
        row = [_cell_of(one, record, reader) for one in SHOWN_COLUMNS[kind]]
        if reader is not None and isinstance(record, _Spoken):
            said = sentence_of(record) if isinstance(record, DecisionRecord) else record
            row = [_safe(reader.say(said.key, said.slots)), *row]
        rows.append(row)
    return csv_lines(rows, reader)


def _cell_of(column: Column, record: Record, reader: Sentences | None) -> str:
    value = column.read(record)
    if column.type == "time" and value is not None:
        return format_stamp(value)
    return cell(value, reader)


def ndjson_rows(
    model: Callable[..., Model], rows: Iterable[tuple[object, ...]]
) -> bytes:
    """Rows as one JSON value a line, each as the list has it."""
    return b"".join(write_json(model(*row)) + b"\n" for row in rows)


def csv_lines(rows: Iterable[Sequence[str]], reader: Sentences | None = None) -> bytes:
    """Rows of cells as CSV (RFC 4180), for programs or for a reader's spreadsheet."""
    text = io.StringIO()
    # Excel takes the separator of lists of its country; Spain's is the semicolon.
    is_spanish = reader is not None and reader.language == "es"
    csv.writer(text, delimiter=";" if is_spanish else ",").writerows(rows)
    return text.getvalue().encode()


def cell(value: object, reader: Sentences | None = None) -> str:
    """A value as a cell; empty for None."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and reader is not None:
        return reader.decimal(str(value))
    if isinstance(value, Mapping | list):
        return write_json(value).decode()
    return _safe(value) if isinstance(value, str) else str(value)


def _safe(text: str) -> str:
    """A cell that no spreadsheet runs as a formula; our numbers stay numbers."""
    return "'" + text if text.startswith(_FORMULA) else text
