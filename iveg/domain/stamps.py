"""Moments as text: ISO-8601 UTC, as in the contract and all documents."""

from datetime import UTC, datetime


def format_stamp(wall: float) -> str:
    """Unix seconds as the contract's ISO-8601 UTC with milliseconds."""
    stamp = datetime.fromtimestamp(wall, UTC).isoformat(timespec="milliseconds")
    return stamp.removesuffix("+00:00") + "Z"


def parse_stamp(text: str) -> float | None:
    """Unix seconds of an ISO-8601 text; None where it is none."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return moment.timestamp()
