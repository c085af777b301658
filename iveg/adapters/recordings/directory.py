"""Directory of recordings of one kind: its files, one after the other."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from iveg.adapters.recordings.mcap_file import McapFile
from iveg.domain.observations import Instant
from iveg.domain.recordings import RecordingFile, RecordingLimits, superfluous

_ENDS, _OPEN = ".mcap", ".mcap.open"
CLOCK_SET_S, SHORTEST_S = 1.0, 10.0
"""Least jump of the wall clock, and least age of a file, for which another begins."""


def file_name(wall: float) -> str:
    """Name of a file by its first moment (Unix s), without its ending."""
    return datetime.fromtimestamp(wall, UTC).strftime("%Y-%m-%dT%H-%M-%SZ")


class RecordingDirectory:
    """Recordings by name, and the open one; blocking.

    Args:
        path: The directory, which the first recording makes.
        limits: Limits of the kept files.
        length_s: Each file ends where the wall clock passes a multiple of this (s).

    Attributes:
        file: The open recording; None while there is none.
    """

    def __init__(
        self, path: Path, limits: RecordingLimits, length_s: float = 3600.0
    ) -> None:
        self.path = path
        self.file: McapFile | None = None
        self._limits, self._length_s = limits, length_s

    # --- the open file ------------------------------------------------------------

    def has_file_for(self, at: Instant) -> bool:
        """Whether the file covers this time, and the clock has not been set since."""
        if self.file is None:
            return False
        start, length_s = self.file.start, self._length_s
        age_s = at.mono - start.mono
        # Not a young file: a clock that keeps jumping would fill the folder.
        was_set = abs(at.wall - start.wall - age_s) > CLOCK_SET_S and age_s > SHORTEST_S
        return not was_set and at.wall // length_s == start.wall // length_s

    def begin(self, start: Instant) -> None:
        """Finish the file, and begin the next.  Raises OSError."""
        self.finish()
        self.path.mkdir(parents=True, exist_ok=True)
        self.file = McapFile(self._free_name(start), start)

    def finish(self) -> None:
        """Close the file, and take ``.open`` from its name.  Raises OSError."""
        file, self.file = self.file, None
        if file is not None:
            file.finish()
            file.path.rename(file.path.with_suffix(""))

    def _free_name(self, start: Instant) -> Path:
        """Unused name: after a clock was set back another file may have the first."""
        names = {file.name for file in self.files()}
        wall = start.wall
        while (name := file_name(wall) + _ENDS) in names:
            wall += 1.0
        return self.path / f"{name}.open"

    # --- all files ----------------------------------------------------------------

    def files(self) -> Sequence[RecordingFile]:
        """All files, oldest first."""
        return [_describe(path) for path in sorted(self.path.glob("*.mcap*"))]

    def left_open(self) -> Sequence[Path]:
        """Files that a crash left open; call it before a recording begins."""
        return sorted(self.path.glob("*" + _OPEN))

    def finished(self) -> Sequence[Path]:
        """Files of finished recordings, oldest first."""
        return sorted(self.path.glob("*" + _ENDS))

    def prune(self) -> None:
        """Delete files over the limits."""
        for file in superfluous(self.files(), self._limits):
            (self.path / file.name).unlink(missing_ok=True)


def _describe(path: Path) -> RecordingFile:
    name, status = path.name.removesuffix(".open"), path.stat()
    is_open = path.name.endswith(_OPEN)
    return RecordingFile(name, status.st_size, is_open, status.st_mtime)
