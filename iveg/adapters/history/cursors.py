"""Places between two pages of a list, as opaque texts that fit into a URL."""

import base64
import binascii
from dataclasses import dataclass

import orjson

from iveg.adapters.history.listings import ListOf, R
from iveg.domain.errors import UnreadableError


@dataclass(frozen=True, slots=True)
class Cursor:
    """The last row of a page: its time and what tells it from others of that time.

    Attributes:
        question: What was asked for (``lists.question_of``): only that goes on here.
        group: Its value in the column that the list is sorted by; None: by time.
    """

    at: float
    key: int | str
    question: str = ""
    group: str | None = None


def write_cursor(cursor: Cursor) -> str:
    """A cursor as opaque text that fits into a URL."""
    group = () if cursor.group is None else (cursor.group,)
    parts = [cursor.at, cursor.key, cursor.question, *group]
    text = base64.urlsafe_b64encode(orjson.dumps(parts))
    return text.decode().rstrip("=")


def read_cursor(text: str, of: ListOf[R]) -> Cursor:
    """A cursor that ``write_cursor`` wrote for the same list.

    Raises:
        UnreadableError: it did not.
    """
    try:
        padded = text.encode("ascii") + b"=" * (-len(text) % 4)
        at, key, question, *group = orjson.loads(base64.urlsafe_b64decode(padded))
    except (ValueError, TypeError, binascii.Error) as error:
        raise UnreadableError("bad_cursor") from error
    is_group = [*map(type, group)] in ([], [str]) and "".join(group).isprintable()
    is_named = isinstance(question, str) and is_group
    if not (isinstance(at, float) and _is_key(key, of) and is_named):
        raise UnreadableError("bad_cursor")
    return Cursor(at, key, question, *group)


def _is_key(key: object, of: ListOf[R]) -> bool:
    # Only what a column can hold: the rest would fail inside the database.
    if of.key.type.python_type is int:
        return type(key) is int and 0 <= key < 2**63
    return isinstance(key, str) and key.isascii() and key.isprintable()
