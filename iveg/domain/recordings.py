"""Recordings as files, and which of them go."""

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
    """Files that are over the limits; never the one that is written."""
    days, size = set[str](), 0
    gone = []
    for file in sorted(files, key=lambda file: file.name, reverse=True):
        days.add(file.day)
        size += file.size
        is_outdated = 0 < limits.days < len(days)
        is_over = is_outdated or 0 < limits.most_bytes < size
        if is_over and not file.is_open:
            gone.append(file)
    return gone
