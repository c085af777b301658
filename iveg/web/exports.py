"""Lists as files: CSV for spreadsheets, NDJSON for programs.

An export runs through every page of a list while it is sent, so that a month of rows
is never held in memory.
"""

import csv
import io
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import fields
from typing import Literal, TypeVar

from starlette.datastructures import Headers

from iveg.domain.records import Record
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
    """What the ``Accept`` header likes best; JSON for whoever does not say."""
    best: Form = "json"
    weight = 0.0
    for part in headers.get("accept", "").split(","):
        kind, _, rest = part.partition(";")
        liked = _quality(rest)
        for form, media_type in MEDIA_TYPES.items():
            if kind.strip().lower() == media_type and liked > weight:
                best, weight = form, liked
    return best


async def write_csv(
    kind: type[R], pages: AsyncIterator[Sequence[R]]
) -> AsyncIterator[bytes]:
    """Rows as CSV (RFC 4180), one column a field of the record, times in UTC."""
    names = [field.name for field in fields(kind)]
    yield _csv_lines([[name.rstrip("_") for name in names]])
    async for records in pages:
        yield _csv_lines(
            [
                [_cell(name, getattr(record, name)) for name in names]
                for record in records
            ]
        )


async def write_ndjson(
    view: Callable[[Sequence[R]], Awaitable[Sequence[Model]]],
    pages: AsyncIterator[Sequence[R]],
) -> AsyncIterator[bytes]:
    """Rows as one JSON value a line, each as the list has it."""
    async for records in pages:
        models = await view(records)
        yield b"".join(write_json(one) + b"\n" for one in models)


def _csv_lines(rows: list[list[str]]) -> bytes:
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue().encode()


def _cell(name: str, value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and (name == "at" or name.endswith("_at")):
        return format_stamp(value)
    if isinstance(value, str) and value.startswith(_FORMULA):
        # A spreadsheet would run it; numbers are ours and stay numbers.
        return "'" + value
    return str(value)


def _quality(parameters: str) -> float:
    for parameter in parameters.split(";"):
        name, _, value = parameter.partition("=")
        if name.strip().lower() == "q":
            try:
                return float(value)
            except ValueError:
                return 0.0
    return 1.0
