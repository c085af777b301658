"""Records what comes in, off the path of everything else: one queue, one process.

The loop packs each input and no more.  Four times a second memories are written out,
piece by piece, and what waits goes to the process that writes (``writer.py``), in
pieces that its pipe takes; who waits for the pipe is a task of its own.  What does not
fit into the queue is not recorded, and counted; so is what a process that ended had not
kept yet.
"""

import asyncio
import logging
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

import orjson

from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.excerpt import write_excerpt
from iveg.adapters.recordings.incoming import (
    Sort,
    UnfinishedMemory,
    pack,
    worth_keeping,
)
from iveg.adapters.recordings.live_feed import LiveFeed
from iveg.adapters.recordings.repair import finish_broken
from iveg.adapters.recordings.writer import PRUNE_S, WriterSetup
from iveg.adapters.recordings.writer_process import WriterProcess
from iveg.adapters.worker import Worker
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import HopError
from iveg.domain.observations import Instant, Observation
from iveg.domain.recordings import RecordingFile
from iveg.domain.records import Record, is_telemetry
from iveg.pipeline.ports import Clock

_log = logging.getLogger(__name__)
_T = TypeVar("_T")
PART = "recordings"
MOST_WAITING, MOST_BYTES = 20_000, 32 * 10**6
WRITE_S = 0.25
RESCUE_S = 1800.0
QUIET_S = 60.0
"""What is dropped is told again where nothing was for so long (s)."""


class InputRecorder:
    """Records what comes in; its methods are called in the loop and never wait.

    Args:
        setup: Of the process that writes.
        clock: For the time of rows.
        is_on: Whether anything is recorded; what there is, is kept in bounds anyway.
        live: Is shown all messages, too.

    Attributes:
        counters: Inputs ``recordings_written``, and ``recordings_dropped`` for want of
            room, or because the process ended before they were kept.
        rule: Tells the rule in force, of which each version is recorded.
    """

    def __init__(
        self,
        setup: WriterSetup,
        clock: Clock,
        *,
        is_on: bool = True,
        live: LiveFeed | None = None,
    ) -> None:
        self.counters = Counter[str]() if live is None else live.counters
        self.rule: Callable[[], DetectionRule | None] = lambda: None
        self._setup, self._clock, self._is_on = setup, clock, is_on
        self._live = live
        self._directory = RecordingDirectory(setup.folder)
        # What a crash left takes minutes: not in this process.
        self._apart = Worker(limit_s=RESCUE_S)
        self._waiting: list[bytes | UnfinishedMemory] = []
        self._bytes = 0
        self._dropped_at = float("-inf")
        self._told_rule: DetectionRule | None = None
        self._writer: WriterProcess | None = None

    # --- what comes in ------------------------------------------------------------

    def measure(self, topic: str, payload: bytes, at: Instant) -> None:
        """A robot's own message, read from the broker."""
        if self._live is not None:
            self._live.measure(topic, payload, at)
        if self._is_on:
            self._queue(pack(Sort.MEASURE, at, topic, payload))

    def notification(
        self, body: bytes, at: Instant, observed: Sequence[Observation]
    ) -> None:
        """A notification of Orion's, and what was read in it."""
        if self._live is not None:
            self._live.notification(body, at)
        if self._is_on:
            self._queue(pack(Sort.NOTIFICATION, at, "", worth_keeping(body, observed)))

    def row(self, record: Record) -> None:
        """A row of the history; telemetry is here already, as it came."""
        if self._is_on and not is_telemetry(record):
            self._write_down(record, type(record).__name__.removesuffix("Record"))

    def note(self, name: str, payload: bytes, at: Instant) -> None:
        """What the loop tells of itself, on the channel of its name."""
        if self._is_on:
            self._queue(pack(Sort.ROW, at, name, payload))

    def memory(self, about: bytes, memory: Iterator[bytes], at: Instant) -> None:
        """What the pipeline has in mind, in pieces, and JSON that tells of it.

        It has its place here; its pieces are made before it goes to be written.
        """
        if self._is_on:
            self._queue(UnfinishedMemory(at, about, memory))

    def tick(self, at: Instant) -> None:
        """The loop lets time pass."""
        if not self._is_on:
            return
        rule = self.rule()
        if rule is not None and rule is not self._told_rule:
            self._told_rule = rule
            self._write_down(rule, "Rule")
        self._queue(pack(Sort.TICK, at))

    def _write_down(self, row: Record | DetectionRule, name: str) -> None:
        payload = orjson.dumps(row, default=dict, option=orjson.OPT_SERIALIZE_NUMPY)
        self._queue(pack(Sort.ROW, self._clock(), name, payload))

    def _queue(self, one: bytes | UnfinishedMemory) -> None:
        size = len(one) if isinstance(one, bytes) else 0
        is_full = len(self._waiting) >= MOST_WAITING
        if is_full or self._bytes + size > MOST_BYTES:
            self._drop()
            return
        self._waiting.append(one)
        self._bytes += size

    def _drop(self) -> None:
        self.counters["recordings_dropped"] += 1
        now = self._clock().mono
        if now - self._dropped_at >= QUIET_S:
            _log.warning("not everything that comes in is recorded: the disk is slow")
        self._dropped_at = now

    # --- the process that writes --------------------------------------------------

    async def run(self) -> None:
        """Until cancelled; ``close`` still writes what waits then.

        Raises:
            HopError: the process ended, or the disk refuses.
        """
        left = await _in_thread(self._directory.left_open)
        rescue = asyncio.create_task(self._rescue(left), name="recordings-rescue")
        try:
            await (self._have_written() if self._is_on else self._prune_forever())
        finally:
            rescue.cancel()
            await asyncio.gather(rescue, return_exceptions=True)

    async def _have_written(self) -> None:
        """Feed one process until it ends.  Raises HopError."""
        writer = self._writer = await _start(self._setup, self.counters)
        feed = asyncio.create_task(self._feed(writer), name="recordings-feed")
        try:
            await writer.listen()
        except HopError:
            # The next one is told the rule anew.
            self._writer = self._told_rule = None
            raise
        finally:
            feed.cancel()
            await asyncio.gather(feed, return_exceptions=True)

    async def _feed(self, writer: WriterProcess) -> None:
        while True:
            await asyncio.sleep(WRITE_S)
            await self._make_memories()
            await writer.feed(self.take_waiting())

    async def _make_memories(self) -> None:
        """Make those that wait; whatever is due comes between two pieces."""
        unfinished = [one for one in self._waiting if not isinstance(one, bytes)]
        for one in unfinished:
            try:
                for _ in one.make():
                    await asyncio.sleep(0)
            except Exception:
                self._waiting.remove(one)
                self.counters["recordings_dropped"] += 1
                _log.exception("a memory cannot be recorded")

    @property
    def waiting(self) -> int:
        """Inputs that wait for the process that writes."""
        return len(self._waiting)

    @property
    def pid(self) -> int | None:
        """Of the process that writes; None while there is none."""
        return None if self._writer is None else self._writer.pid

    def take_waiting(self) -> Sequence[bytes]:
        """What waits for the process that writes."""
        waiting, self._waiting, self._bytes = self._waiting, [], 0
        return [one if isinstance(one, bytes) else one.finished() for one in waiting]

    async def close(self) -> None:
        """Write what waits, and finish the file."""
        writer, self._writer = self._writer, None
        if writer is not None:
            await writer.end(self.take_waiting())
        self._apart.close()

    async def _prune_forever(self) -> None:
        while True:
            limits = self._setup.limits
            await _in_thread(partial(self._directory.prune, limits))
            await asyncio.sleep(PRUNE_S)

    async def _rescue(self, left: Sequence[Path]) -> None:
        for path in left:
            await self._apart.run(finish_broken, path)

    # --- what there is ------------------------------------------------------------

    async def drop_oldest(self) -> bool:
        """Delete the oldest recording; whether there was one that is finished."""
        return await _in_thread(self._directory.drop_oldest)

    async def files(self) -> Sequence[RecordingFile]:
        """All recordings, oldest first."""
        return await _in_thread(self._directory.files)

    @property
    def folder(self) -> Path:
        """Where recordings are."""
        return self._directory.path

    async def finished(self, name: str) -> Path | None:
        """The file of a finished recording."""
        return await _in_thread(partial(self._directory.finished, name))

    async def excerpt(self, target: Path, since: float, until: float) -> int:
        """Write what came in between two moments (Unix s) as one recording.

        Returns:
            How many messages.  What came in the last two seconds may be missing.
        """
        folder = self._directory.path
        return await self._apart.run(write_excerpt, folder, target, since, until)


async def _start(setup: WriterSetup, counters: Counter[str]) -> WriterProcess:
    try:
        return await WriterProcess.start(setup, counters)
    except OSError as error:
        raise HopError("recordings", error.strerror or str(error)) from error


async def _in_thread(work: Callable[[], _T]) -> _T:
    """Have it done where the disk may be slow.  Raises HopError."""
    try:
        return await asyncio.to_thread(work)
    except OSError as error:
        raise HopError("disk", error.strerror or str(error)) from error
