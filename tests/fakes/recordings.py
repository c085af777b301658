"""Recordings without a process of their own: in a folder, and written in place."""

from collections.abc import Callable, Sequence
from pathlib import Path

from iveg.adapters.disk import disk_space
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.incoming import Unpacking
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.recordings.writer import RecordingWriter, WriterSetup
from iveg.domain.disk_space import DiskSpace
from iveg.domain.recordings import RecordingFile


class FakeRecordings:
    """Implements ``web.api.recordings.Recordings``."""

    def __init__(self) -> None:
        self.directory = RecordingDirectory(Path("nowhere"))

    async def files(self) -> Sequence[RecordingFile]:
        return self.directory.files()

    async def finished(self, name: str) -> Path | None:
        return self.directory.finished(name)


class WriterInPlace:
    """Writes what a recorder packs, in the caller's own process and time."""

    def __init__(
        self,
        setup: WriterSetup,
        read_space: Callable[[Path], DiskSpace] = disk_space,
    ) -> None:
        self.writer = RecordingWriter(setup, read_space)
        self._unpacking = Unpacking()

    def write(self, recorder: InputRecorder, now: float) -> None:
        """Write what waits; ``now`` is monotonic (s)."""
        for piece in recorder.take_waiting():
            for came in self._unpacking.feed(piece):
                self.writer.write_input(came)
        self.writer.keep_house(now)


class FakePast:
    """Implements ``web.api.past.Past``.

    Attributes:
        asked: (viewer, Unix s) of each question.
        fails: What the next ones raise.
    """

    def __init__(self) -> None:
        self.asked: list[tuple[str, float]] = []
        self.fails: Exception | None = None

    async def world(self, viewer: str, wall: float) -> bytes:
        self.asked.append((viewer, wall))
        if self.fails is not None:
            raise self.fails
        return b'{"at_s":1}'
