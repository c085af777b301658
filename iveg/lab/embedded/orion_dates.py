"""Dates as Orion writes them."""

import re
from datetime import UTC, datetime
from functools import lru_cache

from iveg.lab.embedded.errors import bad_request

_DATE = re.compile(r"\d{4}-\d{2}-\d{2}(T\d{2}:\d{2}(:\d{2}([.,]\d+)?)?)?(Z|[+-].*)?")


def date_text(value: object) -> bytes:
    """A ``DateTime`` as Orion prints it: UTC with milliseconds.

    Raises:
        FiwareError: 400, not a date.
    """
    if value is None:
        return b"null"
    if isinstance(value, str) and _DATE.fullmatch(value):
        try:
            moment = datetime.fromisoformat(value.replace(",", "."))
        except ValueError:
            moment = None
        if moment is not None:
            moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
            return date_json(moment.timestamp())
    raise bad_request("date has invalid format in attribute value")


def date_json(at: float) -> bytes:
    """Unix seconds as JSON text with milliseconds."""
    return b'"%b"' % date_iso(at).encode()


def date_iso(at: float) -> str:
    """Unix seconds as ISO-8601 with milliseconds and Z."""
    second, milliseconds = divmod(round(at * 1000), 1000)
    return f"{_whole_second(second)}.{milliseconds:03d}Z"


@lru_cache(maxsize=64)
def _whole_second(at: int) -> str:
    return datetime.fromtimestamp(at, UTC).isoformat()[:19]
