"""Recordings without a process of their own: in a folder, and written in place."""

from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path

from iveg.adapters.files import disk_space
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.incoming import unpack
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.recordings.writer import RecordingWriter, WriterSetup
from iveg.domain.recordings import RecordingFile
from iveg.domain.retention import DiskSpace


class FakeRecordings(InputRecorder):
    """Files of a folder, without a process."""

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

    def write(self, recorder: InputRecorder, now: float) -> None:
        """Write what waits; ``now`` is monotonic (s)."""
        for came in unpack(BytesIO(b"".join(recorder.take_waiting()))):
            self.writer.write_input(came)
        self.writer.keep_house(now)
