"""Lists as files: CSV for spreadsheets, NDJSON for programs.

An export runs through every page of a list while it is sent, so that a month of rows is
never held in memory.
"""

import csv
import io
from collections.abc import Callable, Iterable, Mapping
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
    """Form that the ``Accept`` header names first; JSON if it names none."""
    accepted = headers.get("accept", "").lower()
    named = [
        (accepted.index(media_type), form)
        for form, media_type in MEDIA_TYPES.items()
        if media_type in accepted
    ]
    return min(named)[1] if named else "json"


def csv_lines(kind: type[R], records: Iterable[R], *, has_head: bool) -> bytes:
    """Rows as CSV (RFC 4180), one column a field of the record, times in UTC.

    Args:
        kind: Class of the records.
        records: Records, a row each.
        has_head: Whether a line with the names of the columns comes first.
    """
    columns, text = SHOWN_COLUMNS[kind], io.StringIO()
    lines = csv.writer(text)
    if has_head:
        lines.writerow([column.name for column in columns])
    lines.writerows([_cell_of(column, row) for column in columns] for row in records)
    return text.getvalue().encode()


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


def cell(value: object) -> str:
    """A value as a cell; empty for None."""
    if value is None:
        return ""
    # As in JSON, not as Python writes them.
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping | list):
        return write_json(value).decode()
    # No spreadsheet runs a text as a formula; our numbers stay numbers.
    is_formula = isinstance(value, str) and value.startswith(_FORMULA)
    return f"'{value}" if is_formula else str(value)
