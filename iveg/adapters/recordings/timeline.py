"""All recordings of a directory as one line of time."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from iveg.adapters.recordings.chunks import ChunkedRecording, Recorded
from iveg.domain.errors import DataFileError

_LONGEST = 3_610 * 10**9
"""A file is of an hour (ns)."""
_DRIFT = 2 * 10**9
"""So far a file's time may be from the next one's: clocks are corrected slowly (ns)."""


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

    def look_through(self) -> None:
        """Find chunks of files that are open, which later questions then do not."""
        for one in self.files():
            if one.path.suffix != ".mcap":
                _ = one.chunks

    def latest(self, topic: str, by: int, within: int) -> Found | None:
        """The last message of a topic by a moment (ns), ``within`` before it."""
        for file in _begun(self.files(), by, within):
            for number in range(file.at(by), -1, -1):
                if file.chunks[number].last < by - within:
                    break
                messages = file.read(number)
                for index in range(len(messages) - 1, -1, -1):
                    one = messages[index]
                    if one.topic == topic and one.log_time <= by:
                        return Found(one, file, Place(file.first, number, index + 1))
        return None

    def around(self, at: int) -> tuple[int | None, int | None]:
        """The nearest moments before and after one (ns) at which something came."""
        files = self.files()
        begun, next_ones = _begun(files, at), [one.first for one in files]
        before = [min(one.chunks[one.at(at)].last, at) for one in begun if one.chunks]
        for one in begun:
            next_ones += [chunk.first for chunk in one.chunks[one.at(at) + 1 :][:1]]
        after = min((one for one in next_ones if one > at), default=None)
        return max(before, default=None), after

    def holding(self, at: int) -> int:
        """How many files have a moment (ns)."""
        return sum(one.last >= at for one in _begun(self.files(), at))

    def messages(self, since: Place) -> Iterator[Found]:
        """Those behind a place, to the end of what is there now.

        Where the wall clock was set back, files overlap: none of them follows another.
        """
        ends = since.first
        for file in self.files():
            if file.first < since.first:
                continue
            begins = since
            if file.first > since.first:
                if file.first < ends - _DRIFT:
                    continue
                begins = Place(file.first, 0, 0)
            ends = file.last
            for number in range(begins.chunk, len(file.chunks)):
                skipped = begins.passed if number == begins.chunk else 0
                for index, one in enumerate(file.read(number)[skipped:], skipped + 1):
                    yield Found(one, file, Place(file.first, number, index))


def _begun(
    files: Sequence[ChunkedRecording], by: int, within: int = 0
) -> list[ChunkedRecording]:
    """Those that may hold a moment or what came ``within`` before it, newest first.

    Where none does: those that may hold the last one before.
    """
    begun = [one for one in files if one.first <= by]
    if not begun:
        return []
    oldest = min(by - within, begun[-1].first) - _LONGEST
    return [one for one in reversed(begun) if one.first >= oldest]
