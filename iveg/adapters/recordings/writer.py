"""Writer of recordings; blocking, for the recorder's own process.

It ends a chunk every two seconds, so that a crash costs no more than that.
"""

import atexit
import contextlib
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from iveg.adapters.files import disk_errors
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.mcap_file import Channel, McapFile
from iveg.adapters.recordings.pictures import FOLDER, PICTURES, PICTURES_S, WHOLE
from iveg.domain.observations import Instant
from iveg.domain.recordings import RecordingLimits
from iveg.domain.retention import DiskSpace

FLUSH_S, PRUNE_S = 2.0, 60.0
_T = TypeVar("_T")


class Message(NamedTuple):
    """Message that waits to be written."""

    channel: Channel
    at: Instant
    payload: bytes


class RecordingWriter:
    """Writes inputs and pictures; any method may raise OSError.

    Args:
        folder: Folder of the recordings of inputs, with a folder of pictures in it.
        limits: Limits of inputs and of pictures.
        read_space: Space on the disk of a directory.
    """

    def __init__(
        self,
        folder: Path,
        limits: tuple[RecordingLimits, RecordingLimits],
        read_space: Callable[[Path], DiskSpace],
    ) -> None:
        self._inputs, self._pictures = self._both = (
            RecordingDirectory(folder, limits[0]),
            RecordingDirectory(folder / FOLDER, limits[1], PICTURES_S),
        )
        self._read_space = read_space
        self._flushed_at = self._pruned_at = float("-inf")
        self._is_paused = False

    def write(self, messages: Sequence[Message], now: float) -> tuple[int, bool]:
        """Write messages, at ``now`` (monotonic, s).

        Returns:
            Their number, and whether nothing is written, as the disk is short.
        """
        if now - self._pruned_at >= PRUNE_S:
            self._pruned_at = now
            self._keep_house()
        written = 0 if self._is_paused else sum(map(self._add, messages))
        if now - self._flushed_at >= FLUSH_S:
            self._flushed_at = now
            for directory in self._both:
                if directory.file is not None:
                    directory.file.flush()
        return written, self._is_paused

    def finish(self) -> None:
        """Finish the files."""
        # A stack: an error at one file must not leave the other open.
        with contextlib.ExitStack() as stack:
            for directory in self._both:
                stack.callback(directory.finish)

    def left_open(self) -> Sequence[Path]:
        """Files that a crash left open; call it before anything is written."""
        return [path for directory in self._both for path in directory.left_open()]

    def drop_oldest(self) -> bool:
        """Delete the oldest finished recording; returns whether there was one."""
        finished = [path for folder in self._both for path in folder.finished()]
        if finished:
            min(finished, key=lambda path: path.name).unlink(missing_ok=True)
        return bool(finished)

    def _add(self, message: Message) -> bool:
        """Write a message; returns whether there is a file for it."""
        file = self._file_for(message)
        if file is not None:
            file.add(*message)
        return file is not None

    def _file_for(self, message: Message) -> McapFile | None:
        """The file for a message; None for changes without a whole picture before."""
        is_picture = message.channel == PICTURES
        directory = self._pictures if is_picture else self._inputs
        may_begin = not is_picture or message.payload.startswith(WHOLE)
        if may_begin and not directory.has_file_for(message.at):
            directory.begin(message.at)
        return directory.file

    def _keep_house(self) -> None:
        """Delete files over the limits, and record nothing while the disk is short.

        The files are finished then, so that ``DiskWatch`` may delete them.
        """
        for directory in self._both:
            directory.prune()
        folder = self._inputs.path
        folder.mkdir(parents=True, exist_ok=True)
        self._is_paused = self._read_space(folder).is_short(was_short=self._is_paused)
        if self._is_paused:
            self.finish()


# --- in its process ---------------------------------------------------------------


@cache
def _writer_of(*home: Any) -> RecordingWriter:
    """The writer of this process, whose files stay open from call to call."""
    writer = RecordingWriter(*home)
    # A server that is killed leaves this process, which then ends by itself.
    atexit.register(writer.finish)
    return writer


@disk_errors()
def with_writer(home: Any, work: Callable[..., _T], *args: object) -> _T:
    """Do work with the writer of this process; ``home`` as the writer takes it.

    Raises:
        HopError: the disk refuses.
    """
    return work(_writer_of(*home), *args)
