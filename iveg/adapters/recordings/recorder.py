"""Records what comes in, off the path of everything else: one queue, one thread.

The loop queues each message and no more.  Ten times a second a thread writes what
waits, a few milliseconds each time.  What does not fit into the queue is not recorded,
and counted.
"""

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Final, ParamSpec, TypeVar

from iveg.adapters.files import disk_space
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.foxglove import Drawing
from iveg.adapters.recordings.mcap_file import (
    MEASURE,
    NOTIFICATIONS,
    Channel,
    finish_broken,
    write_excerpt,
)
from iveg.adapters.recordings.pictures import PICTURES, PICTURES_S
from iveg.adapters.recordings.writer import Message, RecordingWriter
from iveg.adapters.worker import Worker
from iveg.domain.errors import HopError
from iveg.domain.observations import Instant, Received
from iveg.domain.recordings import RecordingFile, RecordingLimits
from iveg.domain.retention import DiskSpace
from iveg.vital.ports import Clock

_log = logging.getLogger(__name__)
_P = ParamSpec("_P")
_T = TypeVar("_T")
PART: Final = "recordings"
MOST_WAITING, MOST_BYTES = 20_000, 32 * 10**6
WRITE_S: Final = 0.1
RESCUE_S: Final = 1800.0
QUIET_S: Final = 60.0
"""What is dropped is told again where nothing was for so long (s)."""
GRACE_S: Final = 5.0


class InputRecorder:
    """Records what comes in; what a message calls never waits.

    Args:
        folder: Of the recordings of inputs; pictures are in a folder of it.
        clock: For the writer's pace.
        limits: How much of inputs and of pictures is kept.
        read_space: Room on the disk of a directory.

    Attributes:
        counters: Messages ``recordings_written``, and ``recordings_dropped`` for want
            of room.
        pictures: Folder of the pictures of the past.
    """

    def __init__(
        self,
        folder: Path,
        clock: Clock,
        limits: tuple[RecordingLimits, RecordingLimits] | None = None,
        read_space: Callable[[Path], DiskSpace] = disk_space,
    ) -> None:
        self.counters = Counter[str]()
        self.pictures = folder / "pictures"
        of_inputs, of_pictures = limits or (RecordingLimits(), RecordingLimits())
        self._inputs = RecordingDirectory(folder, of_inputs)
        pictures = RecordingDirectory(self.pictures, of_pictures, PICTURES_S)
        self._directories = self._inputs, pictures
        self._writer = RecordingWriter(*self._directories, read_space)
        self._clock, self._drawing = clock, Drawing()
        self._thread = ThreadPoolExecutor(1, PART)
        # What a crash left takes minutes: not in this process.
        self._apart = Worker(limit_s=RESCUE_S)
        self._waiting: list[Message] = []
        self._bytes = 0
        self._dropped_at = float("-inf")

    # --- what comes in ------------------------------------------------------------

    def measure(self, topic: str, payload: bytes, at: Instant) -> None:
        """Record a robot's own message, read from the broker."""
        self._queue(Message(Channel(topic, MEASURE), at, payload))

    def notification(self, body: bytes, at: Instant) -> None:
        """Record a notification of Orion's."""
        self._queue(Message(NOTIFICATIONS, at, body))

    def draw(self, received: Received) -> None:
        """Record what viewers draw of an observation."""
        if received.asked:
            # Nobody knows how old an answer of Orion's is.
            return
        for channel, payload in self._drawing.messages(received):
            self._queue(Message(channel, received.at, payload))

    def picture(self, payload: bytes, at: Instant) -> bool:
        """Record a picture of what pages were sent; whether there is room for it."""
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
            _log.warning("not everything that comes in is recorded: the disk is slow")
        self._dropped_at = now

    # --- the thread that writes ---------------------------------------------------

    async def run(self) -> None:
        """Until cancelled; ``close`` still writes what waits then.

        Raises:
            HopError: the disk refuses.
        """
        left = await self._blocking(self._writer.left_open)
        rescue = asyncio.create_task(self._rescue(left), name="recordings-rescue")
        try:
            while True:
                await self.write()
                await asyncio.sleep(WRITE_S)
        finally:
            rescue.cancel()
            await asyncio.gather(rescue, return_exceptions=True)

    async def write(self) -> None:
        """Write what waits.  Raises HopError: the disk refuses."""
        waiting, self._waiting, self._bytes = self._waiting, [], 0
        written = 0
        try:
            now = self._clock().mono
            written = await self._blocking(self._writer.write, waiting, now)
        except HopError:
            # A file that cannot be finished is one that a crash left.
            with contextlib.suppress(HopError):
                await self._blocking(self._writer.finish)
            raise
        finally:
            self.counters["recordings_written"] += written
            self.counters["recordings_dropped"] += len(waiting) - written

    async def close(self) -> None:
        """Write what waits, and finish the files; a disk that hangs is left."""
        with contextlib.suppress(HopError, TimeoutError):
            async with asyncio.timeout(GRACE_S):
                await self.write()
                await self._blocking(self._writer.finish)
        self._thread.shutdown(wait=False, cancel_futures=True)
        self._apart.close()

    async def _rescue(self, left: Sequence[Path]) -> None:
        for path in left:
            await self._apart.run(finish_broken, path)

    async def _blocking(
        self, work: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs
    ) -> _T:
        """Do it in the thread, one after the other.  Raises HopError."""
        loop = asyncio.get_running_loop()
        try:
            return await loop.run_in_executor(
                self._thread, partial(work, *args, **kwargs)
            )
        except OSError as error:
            raise HopError("disk", error.strerror or str(error)) from error

    # --- what there is ------------------------------------------------------------

    async def drop_oldest(self) -> bool:
        """Delete the oldest recording; whether there was one that is finished."""
        return await self._blocking(self._drop_oldest)

    def _drop_oldest(self) -> bool:
        finished = [path for each in self._directories for path in each.finished()]
        if finished:
            min(finished, key=lambda path: path.name).unlink(missing_ok=True)
        return bool(finished)

    async def files(self) -> Sequence[RecordingFile]:
        """All recordings of what came in, oldest first."""
        return await self._blocking(self._inputs.files)

    async def finished(self, name: str) -> Path | None:
        """The file of a finished recording; None where there is none of this name."""
        paths = await self._blocking(self._inputs.finished)
        return next((path for path in paths if path.name == name), None)

    async def excerpt(self, target: Path, since: float, until: float) -> int:
        """Write what came in between two moments (Unix s) as one recording.

        Returns:
            How many messages.  What came in the last two seconds may be missing.
        """
        folder = self._inputs.path
        return await self._apart.run(write_excerpt, folder, target, since, until)
