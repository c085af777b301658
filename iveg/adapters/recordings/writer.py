"""Writes recordings: a process of its own, fed with inputs on its standard input.

It ends with its feeder, however that ends, and finishes the file.  Every two seconds it
ends a chunk, so that its own end costs no more than that, and says what it has kept.
What ails the disk is said once, and ends it.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import BinaryIO

import orjson

from iveg.adapters import clock
from iveg.adapters.disk import disk_space
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.drawing import Drawing
from iveg.adapters.recordings.fed import answer, run_fed
from iveg.adapters.recordings.incoming import Incoming, Sort, Unpacking
from iveg.adapters.recordings.mcap_file import McapFile
from iveg.domain.disk_space import DiskSpace
from iveg.domain.observations import Instant
from iveg.domain.recordings import RecordingLimits

SETTLE_S, PRUNE_S = 2.0, 60.0
KEPT_ANEW = frozenset({"Rule"})
"""Rows whose newest also stands at the beginning of each file."""
CLOCK_SET_S, SHORTEST_S = 1.0, 10.0
"""A wall clock that is farther off was set: a file begins, if this one is as old."""
_HOUR_S = 3600.0
_PIECE = 1 << 18


@dataclass(frozen=True)
class WriterSetup:
    """What a writer is told at its beginning.

    Attributes:
        folder: Of the recordings.
        limits: How much of them is kept.
        apikey: First part of every measure topic.
        robots: The fleet.
    """

    folder: Path
    limits: RecordingLimits = field(default_factory=RecordingLimits)
    apikey: str = "iveg"
    robots: Sequence[str] = ()

    def line(self) -> bytes:
        """For the writer's standard input."""
        return orjson.dumps({**asdict(self), "folder": str(self.folder)}) + b"\n"

    @classmethod
    def of_line(cls, line: bytes) -> "WriterSetup":
        """What ``line`` was told."""
        setup = orjson.loads(line)
        limits = RecordingLimits(**setup["limits"])
        return cls(Path(setup["folder"]), limits, setup["apikey"], setup["robots"])


class RecordingWriter:
    """Writes inputs into files of an hour; any method may raise OSError.

    Args:
        setup: Where to, and how much is kept.
        read_space: Room on the disk of a directory.

    Attributes:
        kept, dropped: Inputs since the start: in a chunk that is closed, and not
            recorded because the disk is low.
    """

    def __init__(
        self,
        setup: WriterSetup,
        read_space: Callable[[Path], DiskSpace] = disk_space,
    ) -> None:
        self.kept = self.dropped = 0
        self._directory = RecordingDirectory(setup.folder)
        self._limits = setup.limits
        self._read_space = read_space
        self._drawing = Drawing(setup.apikey, setup.robots)
        self._file: McapFile | None = None
        self._open = 0
        """Inputs in the chunk that is open."""
        self._anew: dict[str, Incoming] = {}
        self._settled_at = self._pruned_at = float("-inf")
        self._is_held = False

    def write_input(self, came: Incoming) -> None:
        """Write an input, and what viewers draw of it."""
        if came.sort is Sort.ROW and came.name in KEPT_ANEW:
            self._anew[came.name] = came
        if self._is_held:
            self.dropped += 1
            return
        file = self._file_of(came)
        file.add(came.channel, came.at, came.message)
        for channel, payload in self._drawing.messages(came):
            file.add(channel, came.at, payload)
        self._open += 1

    def keep_house(self, now: float) -> bool:
        """End a chunk and delete what is over, when due (monotonic, s).

        Returns:
            Whether a chunk ended, so that ``kept`` has grown.
        """
        if now - self._pruned_at >= PRUNE_S:
            self._pruned_at = now
            self._directory.prune(self._limits)
            self._look_at_disk()
        if now - self._settled_at < SETTLE_S:
            return False
        self._settled_at = now
        if self._file is not None:
            self._file.settle()
        self._settled()
        return True

    def finish(self) -> None:
        """Finish the file."""
        file, self._file = self._file, None
        if file is not None:
            self._directory.finish(file)
        self._settled()

    def _settled(self) -> None:
        self.kept, self._open = self.kept + self._open, 0

    def _look_at_disk(self) -> None:
        """Record nothing while the disk is low and no older recording can go.

        The file is finished, so that the disk's guard may delete it (``retention``).
        """
        self._directory.path.mkdir(parents=True, exist_ok=True)
        space = self._read_space(self._directory.path)
        is_low = space.is_low(was_low=self._is_held)
        is_last = self._is_held or not self._directory.has_finished()
        self._is_held = is_low and is_last
        if self._is_held:
            self.finish()

    def _file_of(self, came: Incoming) -> McapFile:
        """The file of this hour; another one where the wall clock was set."""
        file, at = self._file, came.at
        if file is not None and _is_of(file.start, at):
            return file
        self.finish()
        self._file = file = self._directory.begin(at)
        for one in self._anew.values():
            if one is not came:
                file.add(one.channel, at, one.message)
        return file


def _is_of(start: Instant, at: Instant) -> bool:
    """Whether a file that began at ``start`` has the hour and clock of a moment."""
    age_s = at.mono - start.mono
    was_set = abs(at.wall - start.wall - age_s) > CLOCK_SET_S and age_s > SHORTEST_S
    return not was_set and at.wall // _HOUR_S == start.wall // _HOUR_S


def serve(source: BinaryIO, answers: BinaryIO) -> None:
    """Write until the source ends.  Raises OSError: the disk refuses."""
    writer = RecordingWriter(WriterSetup.of_line(source.readline()))
    unpacking = Unpacking()
    while piece := os.read(source.fileno(), _PIECE):
        for came in unpacking.feed(piece):
            writer.write_input(came)
        if writer.keep_house(clock.mono()):
            _say(answers, writer)
    writer.finish()
    _say(answers, writer)


def _say(answers: BinaryIO, writer: RecordingWriter) -> None:
    answer(answers, {"written": writer.kept, "dropped": writer.dropped})


if __name__ == "__main__":
    # Where the machine is overloaded is what somebody will want to see again.
    run_fed(serve, OSError, less_urgent=0)
