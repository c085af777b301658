"""Recordings of what came in: one file an hour, and which of them go."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RecordingFile:
    """One recording.

    Attributes:
        name: Of its file, which begins with its first moment (UTC) and sorts by it.
        size: Bytes.
        is_open: Whether it is still being written.
        changed: When it was written last (Unix s).
    """

    name: str
    size: int
    is_open: bool
    changed: float

    @property
    def day(self) -> str:
        """The day of its first moment (UTC)."""
        return self.name[: len("2026-11-24")]


@dataclass(frozen=True)
class RecordingLimits:
    """Bounds of what is kept; 0: without this limit.

    Attributes:
        days: Days with a recording, the newest first.  A clock that is wrong by years
            takes one of them, not all.
        most_bytes: Of all files.
    """

    days: int = 7
    most_bytes: int = 5 * 10**9


def superfluous(
    files: Iterable[RecordingFile], limits: RecordingLimits
) -> Sequence[RecordingFile]:
    """Files that are over the limits, oldest first; never the one that is written."""
    kept = sorted(files, key=lambda one: one.name)
    days = sorted({one.day for one in kept})
    outdated = set(days[: -limits.days]) if limits.days else set()
    left = sum(one.size for one in kept)
    gone = []
    for one in kept:
        is_over = one.day in outdated or 0 < limits.most_bytes < left
        if is_over and not one.is_open:
            gone.append(one)
            left -= one.size
    return gone
