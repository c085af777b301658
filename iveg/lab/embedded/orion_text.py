"""Texts as Orion takes them: JSON of limited depth without forbidden characters."""

import re
from functools import lru_cache
from typing import Any

import orjson

from iveg.lab.embedded.errors import bad_request, parse_error

# --- dates ----------------------------------------------------------------------


# --- text -----------------------------------------------------------------------

FORBIDDEN = frozenset("<>\"'=;()")
_NAME_FORBIDDEN = re.compile(r"[<>\"'=;()\s?/#&]")
_MAX_DEPTH = 128
UNRESTRICTED = "TextUnrestricted"


def load_json(body: bytes) -> object:
    """Parse JSON from an untrusted client.

    Raises:
        FiwareError: 400, not JSON, or nested too deeply.
    """
    try:
        value = orjson.loads(body)
    except orjson.JSONDecodeError:
        raise parse_error() from None
    # Counting brackets is fast and mostly enough; a path of points has many, flat ones.
    if body.count(b"[") + body.count(b"{") > _MAX_DEPTH and _too_deep(value):
        raise parse_error()
    return value


def _too_deep(value: Any) -> bool:
    level = [value]
    for _ in range(_MAX_DEPTH):
        parts = [one.values() if isinstance(one, dict) else one for one in level]
        level = [one for part in parts for one in part if type(one) in (dict, list)]
        if not level:
            return False
    return True


def looks_clean(body: bytes) -> bool:
    """Whether no string in a JSON text can contain a forbidden character.

    A quotation mark inside a string needs a backslash, so the backslash stands for it.
    Eight searches at memory speed instead of a walk over every value.
    """
    return not (
        b"<" in body
        or b">" in body
        or b"'" in body
        or b"=" in body
        or b";" in body
        or b"(" in body
        or b")" in body
        or b"\\" in body
    )


def holds_forbidden(value: object) -> bool:
    """Whether a string contains one of ``< > " ' = ; ( )``; Orion takes any key."""
    if isinstance(value, str):
        return not FORBIDDEN.isdisjoint(value)
    if isinstance(value, dict):
        return any(map(holds_forbidden, value.values()))
    if isinstance(value, list):
        return any(
            holds_forbidden(part) for part in value if type(part) in (str, dict, list)
        )
    return False


def check_given_name(name: object, what: str) -> str:
    """A name that a client gave, if it is one that Orion takes.

    Raises:
        FiwareError: 400, with Orion's sentence.
    """
    if not isinstance(name, str):
        raise bad_request(f"invalid JSON type for {what}")
    check_name(name, what)
    return name


@lru_cache(maxsize=4096)
def check_name(name: str, what: str) -> None:
    """Refuse a name that Orion refuses.

    Raises:
        FiwareError: 400, with Orion's sentence.
    """
    if len(name) > 256:
        raise bad_request(f"{what} length: {len(name)}, max length supported: 256")
    if not name:
        raise bad_request(f"{what} length: 0, min length supported: 1")
    if _NAME_FORBIDDEN.search(name) is not None:
        raise bad_request(f"Invalid characters in {what}")


def read_pattern(text: str | None, name: str) -> re.Pattern[str] | None:
    """A regular expression from a client; None where there is none.

    Raises:
        FiwareError: 400.
    """
    try:
        return None if text is None else re.compile(text)
    except re.error:
        raise bad_request(f"Invalid regex for entity {name}") from None


@lru_cache(maxsize=4096)
def quoted(text: str) -> bytes:
    """A short text as JSON, cached, since names and types recur."""
    return orjson.dumps(text)
