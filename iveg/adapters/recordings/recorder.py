"""Records what comes in, off the path of everything else: one queue, one process.

The loop packs each input and no more.  Four times a second what waits goes to the
process that writes (``writer.py``), in pieces that its pipe takes; who waits for the
pipe is a task of its own.  What does not fit into the queue is not recorded, and
counted; so is what a process that ended had not kept yet.
"""

import asyncio
import contextlib
import logging
import sys
from asyncio.subprocess import PIPE, Process
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Final, NoReturn, TypeVar

import orjson

import iveg
from iveg.adapters.files import disk_space
from iveg.adapters.recordings.incoming import Sort, pack
from iveg.adapters.recordings.mcap_file import finish_broken, write_excerpt
from iveg.adapters.recordings.writer import PRUNE_S, SETUP, WriterSetup
from iveg.adapters.worker import Worker
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import HopError
from iveg.domain.observations import Instant
from iveg.domain.recordings import RecordingFile
from iveg.domain.records import Record, is_telemetry
from iveg.domain.retention import DiskSpace
from iveg.vital.ports import Clock
from iveg.vital.record import RecordSink

_log = logging.getLogger(__name__)
_T = TypeVar("_T")
PART = "recordings"
MOST_WAITING, MOST_BYTES = 20_000, 32 * 10**6
WRITE_S = 0.25
RESCUE_S = 1800.0
QUIET_S = 60.0
"""What is dropped is told again where nothing was for so long (s)."""
PIECE_BYTES = 1 << 16
GRACE_S = 5.0
_GONE = OSError, RuntimeError
"""What a pipe says whose reader has ended; loops differ.  A timeout is an OSError."""
_MODULE: Final = "iveg.adapters.recordings.writer"
_BESIDE_IVEG = Path(iveg.__file__).parents[1]


class WriterProcess:
    """One process, from its start to its end.

    Args:
        process: Just started, with pipes.
        counters: Gets ``recordings_written`` inputs, and ``recordings_dropped``: those
            that it refused, or had not kept when it ended.
    """

    def __init__(self, process: Process, counters: Counter[str]) -> None:
        if process.stdin is None or process.stdout is None:
            raise ValueError("it needs both pipes")
        self._process = process
        self._inputs, self._answers = process.stdin, process.stdout
        self._waiting: deque[bytes] = deque()
        self._counters = counters
        self._handed = 0
        self._answered: Counter[str] = Counter()

    @classmethod
    async def start(cls, setup: WriterSetup, counters: Counter[str]) -> "WriterProcess":
        """Start one.

        Raises:
            HopError: it does not start.
        """
        try:
            # In a session of its own Ctrl-C does not reach it: its input ends it.
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", _MODULE),
                stdin=PIPE,
                stdout=PIPE,
                cwd=_BESIDE_IVEG,
                start_new_session=True,
            )
        except OSError as error:
            raise HopError("recordings", error.strerror or str(error)) from error
        started = cls(process, counters)
        started._waiting.append(SETUP.dump_json(setup) + b"\n")
        return started

    @property
    def pid(self) -> int:
        """Id of the process."""
        return self._process.pid

    async def feed(self, packed: Iterable[bytes]) -> None:
        """Hand over inputs, and count them; waits for the pipe.

        Who is cancelled meanwhile hands over the rest the next time.  The end of the
        process is what ``listen`` tells.
        """
        before = len(self._waiting)
        self._waiting += packed
        self._handed += len(self._waiting) - before
        with contextlib.suppress(*_GONE):
            while self._waiting:
                self._inputs.write(self._next_piece())
                await self._inputs.drain()
                # A pipe that takes all at once holds up nobody either.
                await asyncio.sleep(0)

    def _next_piece(self) -> bytes:
        piece, size = [], 0
        while self._waiting and size < PIECE_BYTES:
            piece.append(self._waiting.popleft())
            size += len(piece[-1])
        return b"".join(piece)

    async def listen(self) -> NoReturn:
        """Take what it says until it ends; what it had not kept then is lost.

        Raises:
            HopError: always, with the reason why it ended.
        """
        refused = ""
        while line := await self._answers.readline():
            answer = orjson.loads(line)
            refused = answer.pop("refused", "")
            if answer:
                self._count(answer)
        code = await self._process.wait()
        lost = self._handed - self._answered.total()
        self._handed -= lost
        self._counters["recordings_dropped"] += lost
        if refused:
            raise HopError("disk", refused)
        raise HopError("recordings", f"its process has ended: {code}")

    def _count(self, counts: dict[str, int]) -> None:
        """Count what became of inputs since it began."""
        fresh = Counter(counts) - self._answered
        self._answered = Counter(counts)
        for what, count in fresh.items():
            self._counters[f"recordings_{what}"] += count

    async def end(self, packed: Iterable[bytes] = ()) -> None:
        """Have it take these, too, and finish; one that hangs is killed."""
        with contextlib.suppress(HopError, *_GONE):
            async with asyncio.timeout(GRACE_S):
                await self.feed(packed)
                self._inputs.close()
                await self.listen()
        if self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()


class InputRecorder:
    """Records what comes in; its methods are called in the loop and never wait.

    Args:
        setup: Of the process that writes.
        clock: For the time of rows.
        is_on: Whether anything is recorded; what there is, is kept in bounds anyway.
        read_space: Room on the disk of a directory.

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
        read_space: Callable[[Path], DiskSpace] = disk_space,
    ) -> None:
        self.counters = Counter[str]()
        self.rule: Callable[[], DetectionRule | None] = lambda: None
        self._setup, self._clock = setup, clock
        self._is_wanted = self._is_on = is_on
        self._read_space = read_space
        self._directory, self._pictures = setup.directories()
        # What a crash left takes minutes: not in this process.
        self._apart = Worker(limit_s=RESCUE_S)
        self._waiting: list[bytes] = []
        self._bytes = 0
        self._dropped_at = float("-inf")
        self._told_rule: DetectionRule | None = None
        self._writer: WriterProcess | None = None

    # --- what comes in ------------------------------------------------------------

    def measure(self, topic: str, payload: bytes, at: Instant) -> None:
        """A robot's own message, read from the broker."""
        if self._is_on:
            self._queue(pack(Sort.MEASURE, at, topic, payload))

    def notification(self, body: bytes, at: Instant) -> None:
        """A notification of Orion's."""
        if self._is_on:
            self._queue(pack(Sort.NOTIFICATION, at, "", body))

    def row(self, record: Record) -> None:
        """A row of the history; telemetry is here already, as it came."""
        if self._is_on and not is_telemetry(record):
            self._write_down(record, type(record).__name__.removesuffix("Record"))

    def picture(self, payload: bytes, at: Instant) -> bool:
        """Queue a picture of what pages were sent; whether there is room for it."""
        return self._is_on and self._queue(pack(Sort.PICTURE, at, payload=payload))

    def note_rule(self) -> None:
        """The rule in force, where it is another than before."""
        rule = self.rule()
        if rule is not None and rule is not self._told_rule:
            self._told_rule = rule
            self._write_down(rule, "Rule")

    def _write_down(self, row: Record | DetectionRule, name: str) -> None:
        payload = orjson.dumps(row, default=dict, option=orjson.OPT_SERIALIZE_NUMPY)
        self._queue(pack(Sort.ROW, self._clock(), name, payload))

    def _queue(self, one: bytes) -> bool:
        is_full = len(self._waiting) >= MOST_WAITING
        if is_full or self._bytes + len(one) > MOST_BYTES:
            self._drop()
            return False
        self._waiting.append(one)
        self._bytes += len(one)
        return True

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
            HopError: the process ended, or the disk refuses or has too little room.
        """
        folders = self._directory, self._pictures
        left = [one for each in folders for one in await _in_thread(each.left_open)]
        rescue = asyncio.create_task(self._rescue(left), name="recordings-rescue")
        try:
            if self._is_wanted:
                await self._have_written()
            else:
                await self._prune_forever()
        finally:
            rescue.cancel()
            await asyncio.gather(rescue, return_exceptions=True)

    async def _have_written(self) -> None:
        """Feed one process until it ends.  Raises HopError."""
        self._is_on = await _in_thread(self._has_room)
        if not self._is_on:
            self.take_waiting()
            raise HopError("disk", f"less than {self._setup.room / 1e9:.0f} GB free")
        writer = self._writer = await WriterProcess.start(self._setup, self.counters)
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

    def _has_room(self) -> bool:
        """Whether recordings fit, those that are there among them."""
        folder = self._directory.path
        folder.mkdir(parents=True, exist_ok=True)
        self._prune()
        own = sum(
            one.size for one in (*self._directory.files(), *self._pictures.files())
        )
        return self._read_space(folder).free + own >= self._setup.room

    async def _feed(self, writer: WriterProcess) -> None:
        while True:
            await asyncio.sleep(WRITE_S)
            self.note_rule()
            await writer.feed(self.take_waiting())

    @property
    def waiting(self) -> int:
        """Inputs that wait for the process that writes."""
        return len(self._waiting)

    @property
    def pid(self) -> int | None:
        """Id of the process that writes; None while there is none."""
        return None if self._writer is None else self._writer.pid

    def take_waiting(self) -> Sequence[bytes]:
        """Take the inputs that wait for the process that writes."""
        waiting, self._waiting, self._bytes = self._waiting, [], 0
        return waiting

    async def close(self) -> None:
        """Write what waits, and finish the file."""
        writer, self._writer = self._writer, None
        if writer is not None:
            await writer.end(self.take_waiting())
        self._apart.close()

    async def _prune_forever(self) -> None:
        while True:
            await _in_thread(self._prune)
            await asyncio.sleep(PRUNE_S)

    def _prune(self) -> None:
        for folder in (self._directory, self._pictures):
            folder.prune()

    async def _rescue(self, left: Sequence[Path]) -> None:
        for path in left:
            await self._apart.run(finish_broken, path)

    # --- what there is ------------------------------------------------------------

    async def drop_oldest(self) -> bool:
        """Delete the oldest recording; whether there was one that is finished."""
        return await _in_thread(self._drop_oldest)

    def _drop_oldest(self) -> bool:
        folders = self._directory, self._pictures
        finished = [one for each in folders if (one := each.oldest()) is not None]
        for one in sorted(finished, key=lambda path: path.name)[:1]:
            one.unlink(missing_ok=True)
        return bool(finished)

    async def files(self) -> Sequence[RecordingFile]:
        """All recordings, oldest first."""
        return await _in_thread(self._directory.files)

    @property
    def pictures(self) -> Path:
        """Folder of the pictures of the past."""
        return self._pictures.path

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


async def _in_thread(work: Callable[[], _T]) -> _T:
    """Have it done where the disk may be slow.  Raises HopError."""
    try:
        return await asyncio.to_thread(work)
    except OSError as error:
        raise HopError("disk", error.strerror or str(error)) from error
