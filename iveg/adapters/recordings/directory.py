"""The directory of one sort of recordings: its files, one after the other."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from iveg.adapters.recordings.mcap_file import McapFile
from iveg.domain.observations import Instant
from iveg.domain.recordings import RecordingFile, RecordingLimits, superfluous

_ENDS, _OPEN = ".mcap", ".mcap.open"
CLOCK_SET_S, SHORTEST_S = 1.0, 10.0
"""A wall clock that is farther off was set: a file begins, if this one is as old."""


def name_of(wall: float) -> str:
    """Name of a file by its first moment (Unix s), without its ending."""
    return datetime.fromtimestamp(wall, UTC).strftime("%Y-%m-%dT%H-%M-%SZ")


class RecordingDirectory:
    """Recordings by name, and the one that is written; blocking.

    Args:
        path: Made when the first recording is.
        limits: How much is kept.
        length_s: Each file ends where the wall clock passes a multiple of this.

    Attributes:
        file: The recording that is written; None while there is none.
    """

    def __init__(
        self,
        path: Path,
        limits: RecordingLimits | None = None,
        length_s: float = 3600.0,
    ) -> None:
        self.path = path
        self.file: McapFile | None = None
        self._limits, self._length_s = limits or RecordingLimits(), length_s

    # --- the one that is written --------------------------------------------------

    def has_file_for(self, at: Instant) -> bool:
        """Whether the file has this time, by a clock that nobody has set since."""
        if self.file is None:
            return False
        start, length_s = self.file.start, self._length_s
        age_s = at.mono - start.mono
        was_set = abs(at.wall - start.wall - age_s) > CLOCK_SET_S and age_s > SHORTEST_S
        return not was_set and at.wall // length_s == start.wall // length_s

    def begin(self, start: Instant) -> None:
        """Finish the file, and begin the next.  Raises OSError."""
        self.finish()
        self.path.mkdir(parents=True, exist_ok=True)
        self.file = McapFile(self._free_name(start), start)

    def finish(self) -> None:
        """Close the file, which has its own name from then on.  Raises OSError."""
        file, self.file = self.file, None
        if file is not None:
            file.finish()
            file.path.rename(file.path.with_suffix(""))

    def _free_name(self, start: Instant) -> Path:
        """A name that no file has, open or finished: a clock may have been set back."""
        taken = {file.name for file in self.files()}
        wall = start.wall
        while (name := name_of(wall) + _ENDS) in taken:
            wall += 1.0
        return self.path / f"{name}.open"

    # --- all of them --------------------------------------------------------------

    def files(self) -> Sequence[RecordingFile]:
        """All of them, oldest first."""
        found = []
        for path in sorted(self.path.glob("*.mcap*")):
            name, status = path.name.removesuffix(".open"), path.stat()
            is_open = path.name.endswith(_OPEN)
            found.append(RecordingFile(name, status.st_size, is_open, status.st_mtime))
        return found

    def left_open(self) -> Sequence[Path]:
        """Files that a crash left open; ask before a recording begins."""
        return sorted(self.path.glob("*" + _OPEN))

    def finished(self) -> Sequence[Path]:
        """Files of finished recordings, oldest first."""
        return sorted(self.path.glob("*" + _ENDS))

    def prune(self) -> None:
        """Delete what is over the limits."""
        for file in superfluous(self.files(), self._limits):
            (self.path / file.name).unlink(missing_ok=True)
