"""Records what comes in, off the path of everything else: one queue, one thread.

The loop appends to the queue and no more.  Four times a second the thread writes what
waits; every two seconds it ends a chunk, so that a crash costs no more than that.  What
does not fit into the queue is not recorded, and counted.
"""

import asyncio
import contextlib
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TypeVar

from iveg.adapters.recordings.directory import RecordingDirectory, finish_broken
from iveg.adapters.recordings.excerpt import write_excerpt
from iveg.adapters.recordings.incoming import (
    NOTIFICATIONS,
    Drawn,
    Incoming,
    Raw,
    Row,
    Tick,
    measure,
)
from iveg.adapters.recordings.mcap_file import McapFile
from iveg.adapters.worker import Worker
from iveg.domain.errors import HopError
from iveg.domain.observations import (
    DetectionFrame,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Received,
    UnreadScan,
    kind_of,
)
from iveg.domain.recordings import RecordingFile, RecordingLimits
from iveg.domain.records import Record, is_telemetry
from iveg.pipeline.ports import Clock
from iveg.pipeline.record import RecordSink

_T = TypeVar("_T")
PART = "recordings"
MOST_WAITING, MOST_BYTES = 20_000, 32 * 10**6
WRITE_S, SETTLE_S, PRUNE_S = 0.25, 2.0, 60.0
RESCUE_S = 1800.0
DRAWN_APART_S: dict[type[Observation], float] = {
    Odometry: 0.1,
    LaserScan: 0.2,
    DetectionFrame: 0.2,
}
"""What viewers draw, and the least time between two of a robot (s)."""
SCANS_APART_S = 0.19
"""The least time between two scans of a topic, byte for byte (s): five a second."""
_EARLY = 0.95
_DRAWN = Odometry | LaserScan | UnreadScan | DetectionFrame
_HOUR_S = 3600.0


class RecordedSink:
    """The history's recorder, whose rows are recorded here, too.

    Implements ``pipeline.record.RecordSink``.
    """

    def __init__(self, history: RecordSink, row: Callable[[Record], None]) -> None:
        self._history, self._row = history, row
        self.flushed = history.flushed

    def enqueue(self, record: Record) -> None:
        """Queue a record in both."""
        self._history.enqueue(record)
        self._row(record)


class InputRecorder:
    """Records what comes in; its methods are called in the loop and never wait.

    Args:
        directory: Of the recordings.
        limits: How much of them is kept.
        clock: For the time of rows, and of what has to be done.
        is_on: Whether anything is recorded; what there is, is kept in bounds anyway.

    Attributes:
        counters: Messages ``recordings_written``, and inputs ``recordings_dropped``
            for want of room.
    """

    def __init__(
        self,
        directory: RecordingDirectory,
        limits: RecordingLimits,
        clock: Clock,
        *,
        is_on: bool = True,
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._directory, self._limits = directory, limits
        self._clock, self._is_on = clock, is_on
        # What a crash left takes minutes: not in this process.
        self._apart = Worker(limit_s=RESCUE_S)
        self._thread = ThreadPoolExecutor(1, PART)
        self._waiting: list[Incoming] = []
        self._bytes = 0
        self._due: dict[tuple[str, object], float] = {}
        self._file: McapFile | None = None
        self._settled_at = self._pruned_at = float("-inf")

    # --- what comes in ------------------------------------------------------------

    def measure(self, topic: str, payload: bytes, at: Instant, is_scan: bool) -> None:
        """A robot's own message, read from the broker."""
        if not self._is_on:
            return
        if not is_scan or self._is_due(topic, None, SCANS_APART_S, at):
            self._queue(Raw(measure(topic), at, payload), len(payload))

    def notification(self, body: bytes, at: Instant, subject: str | None) -> None:
        """A notification of Orion's; ``subject``: the subscription of one of scans."""
        if not self._is_on:
            return
        if subject is None or self._is_due(subject, None, SCANS_APART_S, at):
            self._queue(Raw(NOTIFICATIONS, at, body), len(body))

    def observed(self, received: Received) -> None:
        """An observation of a robot, in whichever copy."""
        if not self._is_on:
            return
        observation = received.observation
        apart_s = DRAWN_APART_S.get(kind_of(observation))
        if apart_s is None or not isinstance(observation, _DRAWN):
            return
        robot_id, kind = observation.robot_id, kind_of(observation)
        if self._is_due(robot_id, kind, apart_s * _EARLY, received.at):
            self._queue(Drawn(received), 0)

    def row(self, record: Record) -> None:
        """A row of the history; telemetry is here already, as it came."""
        if self._is_on and not is_telemetry(record):
            self._queue(Row(record, self._clock()), 0)

    def tick(self, at: Instant) -> None:
        """The loop lets time pass."""
        if self._is_on:
            self._queue(Tick(at), 0)

    def _is_due(self, of: str, kind: object, apart_s: float, at: Instant) -> bool:
        if at.mono < self._due.get((of, kind), float("-inf")):
            return False
        self._due[of, kind] = at.mono + apart_s
        return True

    def _queue(self, incoming: Incoming, size: int) -> None:
        if len(self._waiting) >= MOST_WAITING or self._bytes + size > MOST_BYTES:
            self.counters["recordings_dropped"] += 1
            return
        self._waiting.append(incoming)
        self._bytes += size

    # --- the thread ---------------------------------------------------------------

    async def run(self) -> None:
        """Until cancelled; what waits then is still written."""
        left = self._directory.left_open()
        rescue = asyncio.create_task(self._rescue(left), name="recordings-rescue")
        try:
            while True:
                await asyncio.sleep(WRITE_S if self._is_on else PRUNE_S)
                await self.write()
        finally:
            rescue.cancel()
            await asyncio.gather(rescue, return_exceptions=True)

    async def close(self) -> None:
        """Write what waits, and finish the file."""
        # What ails the disk was told by the part's own failure.
        with contextlib.suppress(HopError):
            await self.write()
            await self._in_thread(self._finish)
        self._thread.shutdown()
        self._apart.close()

    async def drop_oldest(self) -> bool:
        """Delete the oldest recording; whether there was one that is finished."""
        return await self._in_thread(self._directory.drop_oldest)

    async def files(self) -> Sequence[RecordingFile]:
        """All recordings, oldest first."""
        return await self._in_thread(self._directory.files)

    async def finished(self, name: str) -> Path | None:
        """The file of a finished recording."""
        return await self._in_thread(partial(self._directory.finished, name))

    async def excerpt(self, target: Path, since: float, until: float) -> int:
        """Write what came in between two moments (Unix s) as one recording.

        Returns:
            How many messages.  What came in the last two seconds may be missing.
        """
        folder = self._directory.path
        return await self._apart.run(write_excerpt, folder, target, since, until)

    async def _rescue(self, left: Sequence[Path]) -> None:
        for path in left:
            await self._apart.run(finish_broken, path)

    async def write(self) -> None:
        """Write what waits.  Raises HopError: the disk refuses."""
        waiting, self._waiting, self._bytes = self._waiting, [], 0
        self.counters["recordings_written"] += await self._in_thread(
            partial(self._take, waiting, self._clock())
        )

    async def _in_thread(self, work: Callable[[], _T]) -> _T:
        """Have it done where the disk may be slow.  Raises HopError."""
        loop = asyncio.get_running_loop()
        try:
            return await loop.run_in_executor(self._thread, work)
        except OSError as error:
            raise HopError("disk", error.strerror or str(error)) from error

    def _take(self, waiting: Sequence[Incoming], now: Instant) -> int:
        """Write it; how many messages that was."""
        written = 0
        try:
            for one in waiting:
                file = self._file_of(one.at)
                for channel, payload in one.messages():
                    file.add(channel, one.at, payload)
                    written += 1
            self._keep_house(now)
        except OSError:
            self._abandon()
            raise
        return written

    def _file_of(self, at: Instant) -> McapFile:
        """The file of this hour."""
        file = self._file
        if file is not None and at.wall // _HOUR_S != file.start.wall // _HOUR_S:
            self._finish()
        if self._file is None:
            self._file = self._directory.begin(at)
        return self._file

    def _keep_house(self, now: Instant) -> None:
        if self._file is not None and now.mono - self._settled_at >= SETTLE_S:
            self._settled_at = now.mono
            self._file.settle()
        if now.mono - self._pruned_at >= PRUNE_S:
            self._pruned_at = now.mono
            self._directory.prune(self._limits)

    def _finish(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            self._directory.finish(file)

    def _abandon(self) -> None:
        """Leave a file whose disk refuses; its closed chunks are finished later."""
        file, self._file = self._file, None
        if file is not None:
            file.abandon()
