"""Recordings that lie in a folder, without a thread that writes them."""

from collections.abc import Sequence
from pathlib import Path

from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.domain.recordings import RecordingFile


class FakeRecordings:
    """Implements ``web.api.recordings.Recordings``."""

    def __init__(self) -> None:
        self.directory = RecordingDirectory(Path("nowhere"))

    async def files(self) -> Sequence[RecordingFile]:
        return self.directory.files()

    async def finished(self, name: str) -> Path | None:
        return self.directory.finished(name)
