"""Moments as text (ISO-8601 UTC, as in contract and documents) and as seconds."""

from datetime import UTC, datetime
from functools import lru_cache
from math import floor

from iveg.domain.observations import Instant


def format_stamp(wall: float) -> str:
    """Unix seconds as the contract's ISO-8601 UTC with milliseconds."""
    whole = floor(wall)
    carried, micros = divmod(round((wall - whole) * 1e6), 1_000_000)
    return f"{_second(whole + carried)}.{micros // 1000:03d}Z"


@lru_cache(maxsize=4096)
def _second(wall: int) -> str:
    """Text of a whole second, without its end.

    The cache has the seconds of all people and alerts, which are drawn many times.
    """
    return datetime.fromtimestamp(wall, UTC).isoformat().removesuffix("+00:00")


def parse_stamp(text: str) -> float | None:
    """Unix seconds of an ISO-8601 text; None: it is no such text."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return None
    if moment.tzinfo is None:
        # The contract writes UTC, so a stamp without a zone is UTC.
        moment = moment.replace(tzinfo=UTC)
    return moment.timestamp()


def wall_of(at: Instant | None) -> float | None:
    """Wall-clock time of an instant (Unix s); None for None."""
    return None if at is None else at.wall
