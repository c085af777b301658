"""Writes recordings: a process of its own, fed with inputs on its standard input.

It ends with its feeder, however that ends, and finishes the files.  Every two seconds
it ends a chunk, so that its own end costs no more than that, and says what it has kept.
What ails the disk is said once, and ends it.
"""

import contextlib
import signal
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, Final

import orjson
from pydantic import TypeAdapter

from iveg.adapters import clock
from iveg.adapters.files import disk_space, give_way
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.foxglove import Drawing
from iveg.adapters.recordings.incoming import WHOLE, Incoming, Sort, unpack
from iveg.adapters.recordings.mcap_file import Channel, McapFile
from iveg.domain.observations import Instant
from iveg.domain.recordings import RecordingLimits
from iveg.domain.retention import DiskSpace

SETTLE_S, PRUNE_S = 2.0, 60.0
KEPT_ANEW = frozenset({"Rule"})
"""Rows whose newest also stands at the beginning of each file."""
CLOCK_SET_S, SHORTEST_S = 1.0, 10.0
"""A wall clock that is farther off was set: a file begins, if this one is as old."""
INPUTS_S: Final = 3600.0
PICTURES_S: Final = 300.0
"""Length of a file; short where the one that is written is looked through."""


@dataclass(frozen=True)
class WriterSetup:
    """Setup of a writer, told at its beginning.

    Attributes:
        folder: Of the recordings of inputs; pictures are in a folder of it.
        limits: How much of inputs is kept; ``pictures`` of those.
        apikey: First part of every measure topic.
        robots: The fleet.
    """

    folder: Path
    limits: RecordingLimits = field(default_factory=RecordingLimits)
    pictures: RecordingLimits = field(default_factory=RecordingLimits)
    apikey: str = "iveg"
    robots: Sequence[str] = ()

    @property
    def room(self) -> int:
        """Bytes that a disk must have for recordings: twice as many as they may take.

        What is not bounded counts as what is by default.
        """
        kept = self.limits.most_bytes, self.pictures.most_bytes
        return 2 * sum(one or RecordingLimits.most_bytes for one in kept)

    def directories(self) -> tuple[RecordingDirectory, RecordingDirectory]:
        """Directories of inputs and of pictures."""
        return (
            RecordingDirectory(self.folder, self.limits),
            RecordingDirectory(self.folder / "pictures", self.pictures),
        )


SETUP: Final = TypeAdapter(WriterSetup)
"""Writes it for the writer's standard input, and reads it there."""


class _Series:
    """Files of one sort, one after the other; a method may raise OSError.

    Args:
        directory: Where they are.
        length_s: Each ends where the wall clock passes a multiple of this.
    """

    def __init__(self, directory: RecordingDirectory, length_s: float) -> None:
        self.directory, self._length_s = directory, length_s
        self.file: McapFile | None = None

    def fits(self, at: Instant) -> bool:
        """Whether the file has this time, by a clock that nobody has set since."""
        if self.file is None:
            return False
        start = self.file.start
        age_s = at.mono - start.mono
        was_set = abs(at.wall - start.wall - age_s) > CLOCK_SET_S and age_s > SHORTEST_S
        length_s = self._length_s
        return not was_set and at.wall // length_s == start.wall // length_s

    def begin(self, at: Instant) -> McapFile:
        """The next file."""
        self.finish()
        self.file = self.directory.begin(at)
        return self.file

    def settle(self) -> None:
        """Have all that was written survive this process."""
        if self.file is not None:
            self.file.settle()

    def finish(self) -> None:
        """Finish the file."""
        file, self.file = self.file, None
        if file is not None:
            self.directory.finish(file)


class RecordingWriter:
    """Writes inputs into files of an hour; any method may raise OSError.

    Pictures go into files of five minutes, each of which begins with a whole one.

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
        inputs, pictures = setup.directories()
        self._inputs = _Series(inputs, INPUTS_S)
        self._pictures = _Series(pictures, PICTURES_S)
        self._all = self._inputs, self._pictures
        self._read_space = read_space
        self._drawing = Drawing(setup.apikey, setup.robots)
        self._open = 0
        """Inputs in chunks that are open."""
        self._anew: dict[str, Incoming] = {}
        self._settled_at = self._pruned_at = float("-inf")
        self._is_held = False

    def write_input(self, came: Incoming) -> None:
        """Write an input and what viewers draw of it, or a picture."""
        if came.sort is Sort.ROW and came.name in KEPT_ANEW:
            self._anew[came.name] = came
        if self._is_held:
            self.dropped += 1
        elif came.sort is Sort.PICTURE:
            self._write_picture(came)
        else:
            self._write(self._inputs_at(came), came, self._drawing.messages(came))

    def _write_picture(self, came: Incoming) -> None:
        series = self._pictures
        if came.payload.startswith(WHOLE) and not series.fits(came.at):
            series.begin(came.at)
        if series.file is None:
            # Changes of a picture that is not here.
            self.dropped += 1
        else:
            self._write(series.file, came)

    def _write(
        self,
        file: McapFile,
        came: Incoming,
        drawn: Iterable[tuple[Channel, bytes]] = (),
    ) -> None:
        for channel, payload in ((came.channel, came.payload), *drawn):
            file.add(channel, came.at, payload)
        self._open += 1

    def _inputs_at(self, came: Incoming) -> McapFile:
        """The file of this hour; another one where the wall clock was set."""
        file = self._inputs.file
        if file is not None and self._inputs.fits(came.at):
            return file
        file = self._inputs.begin(came.at)
        for one in self._anew.values():
            if one is not came:
                file.add(one.channel, came.at, one.payload)
        return file

    def keep_house(self, now: float) -> bool:
        """End a chunk and delete what is over, when due (monotonic, s).

        Returns:
            Whether a chunk ended, so that ``kept`` has grown.
        """
        if now - self._pruned_at >= PRUNE_S:
            self._pruned_at = now
            for series in self._all:
                series.directory.prune()
            self._look_at_disk()
        if now - self._settled_at < SETTLE_S:
            return False
        self._settled_at = now
        for series in self._all:
            series.settle()
        self._settled()
        return True

    def finish(self) -> None:
        """Finish the files."""
        for series in self._all:
            series.finish()
        self._settled()

    def _settled(self) -> None:
        self.kept, self._open = self.kept + self._open, 0

    def _look_at_disk(self) -> None:
        """Record nothing while the disk is low and no older recording can go.

        The files are finished, so that the disk's guard may delete them
        (``retention``).
        """
        folder = self._inputs.directory.path
        folder.mkdir(parents=True, exist_ok=True)
        is_low = self._read_space(folder).is_low(was_low=self._is_held)
        has_older = any(one.directory.oldest() for one in self._all)
        self._is_held = is_low and (self._is_held or not has_older)
        if self._is_held:
            self.finish()


# --- the process ------------------------------------------------------------------


def serve(source: BinaryIO, answers: BinaryIO) -> None:
    """Write until the source ends.  Raises OSError: the disk refuses."""
    writer = RecordingWriter(SETUP.validate_json(source.readline()))
    for came in unpack(source):
        writer.write_input(came)
        if writer.keep_house(clock.mono()):
            _answer(answers, {"written": writer.kept, "dropped": writer.dropped})
    writer.finish()
    _answer(answers, {"written": writer.kept, "dropped": writer.dropped})


def _answer(answers: BinaryIO, message: Mapping[str, object]) -> None:
    """Tell the feeder; where nobody is left to be told, the source ends, too."""
    with contextlib.suppress(BrokenPipeError):
        answers.write(orjson.dumps(message) + b"\n")


def main() -> None:
    """Serve on standard input and output; signals are the feeder's to heed."""
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, signal.SIG_IGN)
    # Where the machine is overloaded is what somebody will want to see again.
    give_way(0)
    with (
        open(0, "rb") as source,
        open(1, "wb", buffering=0) as answers,
    ):
        try:
            serve(source, answers)
        except OSError as error:
            _answer(answers, {"refused": error.strerror or str(error)})
            sys.exit(1)


if __name__ == "__main__":
    main()
