"""All recordings of a directory as one line of time."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from iveg.adapters.recordings.chunks import ChunkedRecording, Recorded
from iveg.domain.errors import DataFileError


class Place(NamedTuple):
    """Between two messages.

    Attributes:
        first: The first moment of the file (ns).
        passed: How many messages of the chunk are behind it.
    """

    first: int
    chunk: int
    passed: int


class Found(NamedTuple):
    """A message, its file, and the place behind it."""

    message: Recorded
    file: ChunkedRecording
    behind: Place


class Timeline:
    """Messages from any moment on.

    Args:
        folder: Of the recordings.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: dict[Path, ChunkedRecording] = {}
        self._unusable: set[Path] = set()

    def files(self) -> list[ChunkedRecording]:
        """All that can be read, oldest first; what others wrote is passed over.

        Raises:
            DataFileError: one cannot be read any more.
        """
        there = {
            one for one in self._folder.glob("*.mcap*") if one.suffix != ".rescued"
        }
        self._files = {path: one for path, one in self._files.items() if path in there}
        for path in there - set(self._files) - self._unusable:
            try:
                self._files[path] = ChunkedRecording(path)
            except DataFileError:
                if path.suffix == ".mcap":
                    self._unusable.add(path)
        for path, one in self._files.items():
            if path.suffix != ".mcap":
                one.refresh()
        return sorted(self._files.values(), key=lambda one: one.first)

    def latest(self, topic: str, by: int, within: int) -> Found | None:
        """The last message of a topic by a moment (ns), ``within`` before it."""
        for file in reversed(self.files()):
            for number in range(file.at(by), -1, -1):
                if file.chunks[number].last < by - within:
                    return None
                messages = file.read(number)
                for index in range(len(messages) - 1, -1, -1):
                    one = messages[index]
                    if one.topic == topic and one.log_time <= by:
                        return Found(one, file, Place(file.first, number, index + 1))
        return None

    def messages(self, since: Place) -> Iterator[Found]:
        """Those behind a place, to the end of what is there now."""
        for file in self.files():
            if file.first < since.first:
                continue
            begins = since if file.first == since.first else Place(file.first, 0, 0)
            for number in range(begins.chunk, len(file.chunks)):
                skipped = begins.passed if number == begins.chunk else 0
                for index, one in enumerate(file.read(number)[skipped:], skipped + 1):
                    yield Found(one, file, Place(file.first, number, index))
