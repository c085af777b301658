"""Lists as files: CSV for spreadsheets, NDJSON for programs.

An export runs through every page of a list while it is sent, so that a month of rows is
never held in memory.
"""

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Literal, TypeVar

from starlette.datastructures import Headers

from iveg.domain.records import SHOWN_COLUMNS, Column, Record
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, write_json

Form = Literal["json", "csv", "ndjson"]
MEDIA_TYPES: dict[Form, str] = {
    "json": "application/json",
    "csv": "text/csv",
    "ndjson": "application/x-ndjson",
}
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
R = TypeVar("R", bound=Record)


def form_of(headers: Headers) -> Form:
    """The form that the ``Accept`` header names first; JSON without one."""
    accepted = headers.get("accept", "").lower()
    named = [
        (accepted.index(media_type), form)
        for form, media_type in MEDIA_TYPES.items()
        if media_type in accepted
    ]
    return min(named)[1] if named else "json"


def csv_head(kind: type[R]) -> bytes:
    """The first line of rows as CSV (RFC 4180), one column a field of the record."""
    return _csv_lines([[one.name for one in SHOWN_COLUMNS[kind]]])


def csv_rows(kind: type[R], records: Iterable[R]) -> bytes:
    """Rows below that line, times in UTC."""
    columns = SHOWN_COLUMNS[kind]
    return _csv_lines([_cell_of(one, row) for one in columns] for row in records)


def _cell_of(column: Column, record: Record) -> str:
    value = column.read(record)
    if column.type == "time" and value is not None:
        return format_stamp(value)
    return cell(value)


def ndjson_rows(
    model: Callable[..., Model], rows: Iterable[tuple[object, ...]]
) -> bytes:
    """Rows as one JSON value a line, each as the list has it."""
    return b"".join(write_json(model(*row)) + b"\n" for row in rows)


def _csv_lines(rows: Iterable[Sequence[str]]) -> bytes:
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue().encode()


def cell(value: object) -> str:
    """A value as a cell; empty for None."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping | list):
        return write_json(value).decode()
    return _safe(value) if isinstance(value, str) else str(value)


def _safe(text: str) -> str:
    """A cell that no spreadsheet runs as a formula; our numbers stay numbers."""
    return "'" + text if text.startswith(_FORMULA) else text
