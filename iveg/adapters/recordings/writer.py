"""Writes recordings; blocking, for the one thread that the recorder has for it.

Every two seconds it ends a chunk, so that a crash costs no more than that.
"""

import contextlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from iveg.adapters.files import disk_space
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.mcap_file import Channel, McapFile
from iveg.adapters.recordings.pictures import PICTURES, WHOLE
from iveg.domain.observations import Instant
from iveg.domain.retention import DiskSpace

FLUSH_S, PRUNE_S = 2.0, 60.0


class Message(NamedTuple):
    """A message that waits to be written."""

    channel: Channel
    at: Instant
    payload: bytes


class RecordingWriter:
    """Writes what came in, and pictures; any method may raise OSError.

    Args:
        inputs: Recordings of what came in.
        pictures: Recordings of pictures, each of which begins with a whole one.
        read_space: Room on the disk of a directory.
    """

    def __init__(
        self,
        inputs: RecordingDirectory,
        pictures: RecordingDirectory,
        read_space: Callable[[Path], DiskSpace] = disk_space,
    ) -> None:
        self._inputs, self._pictures = self._both = inputs, pictures
        self._read_space = read_space
        self._flushed_at = self._pruned_at = float("-inf")
        self._is_held = False

    def write(self, messages: Sequence[Message], now: float) -> int:
        """Write messages; returns how many were.  ``now`` is monotonic (s)."""
        if now - self._pruned_at >= PRUNE_S:
            self._pruned_at = now
            self._keep_house()
        written = 0 if self._is_held else sum(map(self._add, messages))
        if now - self._flushed_at >= FLUSH_S:
            self._flushed_at = now
            for each in self._both:
                if each.file is not None:
                    each.file.flush()
        return written

    def finish(self) -> None:
        """Finish the files."""
        # One that fails keeps no other open.
        with contextlib.ExitStack() as stack:
            for each in self._both:
                stack.callback(each.finish)

    def left_open(self) -> Sequence[Path]:
        """Files that a crash left open; ask before anything is written."""
        return [path for each in self._both for path in each.left_open()]

    def _add(self, message: Message) -> bool:
        """Write a message; whether there is a file for it."""
        file = self._file_for(message)
        if file is not None:
            file.add(*message)
        return file is not None

    def _file_for(self, message: Message) -> McapFile | None:
        """The file of this time; None for changes of a picture that is not there."""
        is_picture = message.channel is PICTURES
        directory = self._pictures if is_picture else self._inputs
        may_begin = not is_picture or message.payload.startswith(WHOLE)
        if may_begin and not directory.has_file_for(message.at):
            directory.begin(message.at)
        return directory.file

    def _keep_house(self) -> None:
        """Delete what is over the limits, and record nothing while the disk is low.

        The files are finished then, so that the disk's guard may delete them
        (``retention``).
        """
        for each in self._both:
            each.prune()
        folder = self._inputs.path
        folder.mkdir(parents=True, exist_ok=True)
        self._is_held = self._read_space(folder).is_low(was_low=self._is_held)
        if self._is_held:
            self.finish()
