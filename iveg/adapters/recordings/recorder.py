"""Recorder of inputs, apart from all other work: one queue, one process.

The loop only queues each message.  Ten times a second another process takes the queue
and writes it: a thread would hold up the loop, for the interpreter runs one of both.
Messages that do not fit into the queue are counted and dropped.
"""

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, TypeVar

from iveg.adapters.files import disk_errors, disk_space
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.foxglove import Drawing
from iveg.adapters.recordings.mcap_file import (
    MEASURE,
    NOTIFICATIONS,
    Channel,
    finish_broken,
    write_excerpt,
)
from iveg.adapters.recordings.pictures import FOLDER, PICTURES
from iveg.adapters.recordings.writer import Message, RecordingWriter, with_writer
from iveg.adapters.worker import Worker
from iveg.domain.errors import HopError
from iveg.domain.observations import Instant, Received
from iveg.domain.recordings import RecordingFile, RecordingLimits
from iveg.domain.retention import DiskSpace
from iveg.vital.ports import Clock

_log = logging.getLogger(__name__)
_T = TypeVar("_T")
PART: Final = "recordings"
MOST_WAITING, MOST_BYTES = 20_000, 32 * 10**6
WRITE_S: Final = 0.1
RESCUE_S: Final = 1800.0
QUIET_S: Final = 60.0
"""Time without a dropped message after which the next is logged again (s)."""
GRACE_S: Final = 5.0


class InputRecorder:
    """Records inputs; the methods for messages never wait.

    Args:
        folder: Folder of the recordings of inputs, with a folder of pictures in it.
        clock: Clock for the writer's pace.
        limits: Limits of inputs and of pictures.
        read_space: Space on the disk of a directory; a function of a module.
        worker: The process that writes.

    Attributes:
        is_paused: Whether nothing is recorded, as the disk is short.
        counters: Messages ``recordings_written``, and ``recordings_dropped`` because
            queue or disk was full.
        pictures: Folder of the pictures of the past.
    """

    def __init__(
        self,
        folder: Path,
        clock: Clock,
        limits: tuple[RecordingLimits, RecordingLimits],
        read_space: Callable[[Path], DiskSpace] = disk_space,
        worker: Worker | None = None,
    ) -> None:
        self.counters, self.is_paused = Counter[str](), False
        self.pictures = folder / FOLDER
        self._home = folder, limits, read_space
        self._inputs = RecordingDirectory(folder, limits[0])
        self._clock, self._drawing = clock, Drawing()
        self._worker = worker or Worker()
        # Files that a crash left take minutes of CPU, so another process reads them.
        self._apart = Worker(limit_s=RESCUE_S)
        self._waiting: list[Message] = []
        self._bytes = 0
        self._dropped_at = float("-inf")

    # --- inputs -------------------------------------------------------------------

    def measure(self, topic: str, payload: bytes, at: Instant) -> None:
        """Record a robot's own message, read from the broker."""
        self._queue(Message(Channel(topic, MEASURE), at, payload))

    def notification(self, body: bytes, at: Instant) -> None:
        """Record a notification of Orion."""
        self._queue(Message(NOTIFICATIONS, at, body))

    def draw(self, received: Received) -> None:
        """Record an observation's messages for viewers."""
        if received.is_query_answer:
            # The age of Orion's answer is unknown.
            return
        for channel, payload in self._drawing.messages(received):
            self._queue(Message(channel, received.at, payload))

    def picture(self, payload: bytes, at: Instant) -> bool:
        """Record a picture; returns whether the queue has room for it."""
        return self._queue(Message(PICTURES, at, payload))

    def _queue(self, message: Message) -> bool:
        size = len(message.payload)
        if len(self._waiting) >= MOST_WAITING or self._bytes + size > MOST_BYTES:
            self._drop()
            return False
        self._waiting.append(message)
        self._bytes += size
        return True

    def _drop(self) -> None:
        self.counters["recordings_dropped"] += 1
        now = self._clock().mono
        if now - self._dropped_at >= QUIET_S:
            _log.warning("recordings: inputs are dropped, as the disk is slow")
        self._dropped_at = now

    # --- the process that writes --------------------------------------------------

    async def run(self) -> None:
        """Write until cancelled; ``close`` then writes waiting messages.

        Raises:
            HopError: the disk refuses.
        """
        files = await self._with_writer(RecordingWriter.left_open)
        rescue = asyncio.create_task(self._rescue(files), name="recordings-rescue")
        try:
            while True:
                await self.write()
                await asyncio.sleep(WRITE_S)
        finally:
            rescue.cancel()
            await asyncio.gather(rescue, return_exceptions=True)

    async def write(self) -> None:
        """Write waiting messages.  Raises HopError: the disk refuses."""
        waiting, self._waiting, self._bytes = self._waiting, [], 0
        count = 0
        try:
            count, self.is_paused = await self._with_writer(
                RecordingWriter.write, waiting, self._clock().mono
            )
        except HopError:
            # A file that cannot be finished is rescued as after a crash.
            with contextlib.suppress(HopError):
                await self._with_writer(RecordingWriter.finish)
            raise
        finally:
            self.counters["recordings_written"] += count
            self.counters["recordings_dropped"] += len(waiting) - count

    async def close(self) -> None:
        """Write waiting messages, and finish the files; a disk that hangs is left."""
        with contextlib.suppress(HopError, TimeoutError):
            async with asyncio.timeout(GRACE_S):
                await self.write()
                await self._with_writer(RecordingWriter.finish)
        self._worker.close()
        self._apart.close()

    async def _rescue(self, left: Sequence[Path]) -> None:
        for path in left:
            await self._apart.run(finish_broken, path)

    async def _with_writer(self, work: Callable[..., _T], *args: object) -> _T:
        """Do work in the process, one call after the other.  Raises HopError."""
        return await self._worker.run(with_writer, self._home, work, *args)

    # --- stored recordings --------------------------------------------------------

    async def drop_oldest(self) -> bool:
        """Delete the oldest finished recording; returns whether there was one."""
        return await self._with_writer(RecordingWriter.drop_oldest)

    async def files(self) -> Sequence[RecordingFile]:
        """All recordings of inputs, oldest first."""
        with disk_errors():
            return await asyncio.to_thread(self._inputs.files)

    async def finished(self, name: str) -> Path | None:
        """Path of a finished recording; None where none has this name."""
        with disk_errors():
            paths = await asyncio.to_thread(self._inputs.finished)
        return next((path for path in paths if path.name == name), None)

    async def excerpt(self, target: Path, since: float, until: float) -> int:
        """Write inputs between two moments (Unix s) as one recording.

        Returns:
            Number of messages.  Those of the last two seconds may be missing.
        """
        return await self._apart.run(
            write_excerpt, self._inputs.path, target, since, until
        )
