"""The directory of the recordings: names, sizes, and which file is deleted next."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from iveg.adapters.recordings.mcap_file import McapFile
from iveg.domain.observations import Instant
from iveg.domain.recordings import RecordingFile, RecordingLimits, superfluous

_ENDS, _OPEN = ".mcap", ".mcap.open"
NAME = "%Y-%m-%dT%H-%M-%SZ"
"""Of a file: its first moment (UTC)."""


class RecordingDirectory:
    """Recordings by name; blocking, for the thread that writes them.

    Args:
        path: Made when the first recording is.
        limits: How much is kept.
    """

    def __init__(self, path: Path, limits: RecordingLimits | None = None) -> None:
        self.path, self._limits = path, limits or RecordingLimits()

    def begin(self, start: Instant) -> McapFile:
        """A new recording.  Raises OSError."""
        self.path.mkdir(parents=True, exist_ok=True)
        return McapFile(self._free_name(start), start)

    def _free_name(self, start: Instant) -> Path:
        """A name that no file has, open or finished: a clock may have been set back."""
        wall = start.wall
        while True:
            stem = datetime.fromtimestamp(wall, UTC).strftime(NAME)
            if not (self.path / (stem + _ENDS)).exists():
                found = self.path / (stem + _OPEN)
                if not found.exists():
                    return found
            wall += 1.0

    def finish(self, file: McapFile) -> None:
        """Close a recording, which has its own name from then on.  Raises OSError."""
        file.finish()
        file.path.rename(file.path.with_suffix(""))

    def left_open(self) -> Sequence[Path]:
        """Files that a crash left open; ask before a recording begins."""
        return sorted(self.path.glob("*" + _OPEN))

    def files(self) -> Sequence[RecordingFile]:
        """All of them, oldest first."""
        found = []
        for path in sorted(self.path.glob("*.mcap*")):
            name = path.name.removesuffix(".open")
            status = path.stat()
            is_open = path.name.endswith(_OPEN)
            found.append(RecordingFile(name, status.st_size, is_open, status.st_mtime))
        return found

    def prune(self) -> int:
        """Delete what is over the limits; how many files."""
        gone = superfluous(self.files(), self._limits)
        for one in gone:
            (self.path / one.name).unlink(missing_ok=True)
        return len(gone)

    def oldest(self) -> Path | None:
        """The oldest that is finished."""
        finished = (self.path / one.name for one in self.files() if not one.is_open)
        return next(finished, None)

    def finished(self, name: str) -> Path | None:
        """The file of a finished recording; None where there is none of this name."""
        known = {one.name for one in self.files() if not one.is_open}
        return self.path / name if name in known else None
