"""Recordings as files, and the limits of their number and size."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RecordingFile:
    """One recording.

    Attributes:
        name: Name of its file; begins with its first moment (UTC) and sorts by it.
        size: Size (bytes).
        is_open: Whether it is still being written.
        changed_at: Time of the newest write (Unix s).
    """

    name: str
    size: int
    is_open: bool
    changed_at: float

    @property
    def day(self) -> str:
        """Day of its first moment (UTC)."""
        return self.name[: len("2026-11-24")]


@dataclass(frozen=True)
class RecordingLimits:
    """Limits of stored recordings; 0: no limit.

    Attributes:
        days: Number of days with a recording.  A clock that is wrong by years costs one
            of them, not all.
        most_bytes: Size of all files (bytes).
    """

    days: int
    most_bytes: int


def superfluous(
    files: Iterable[RecordingFile], limits: RecordingLimits
) -> Iterator[RecordingFile]:
    """Files beyond the limits, newest first; never a file that is written."""
    days, size = set[str](), 0
    for file in sorted(files, key=lambda file: file.name, reverse=True):
        days.add(file.day)
        size += file.size
        is_outdated = 0 < limits.days < len(days)
        if (is_outdated or 0 < limits.most_bytes < size) and not file.is_open:
            yield file
