"""The process that writes recordings, as its feeder sees it.

It is told its setup in the first line of its input, and answers in lines of JSON.  It
ends when its input does.
"""

import asyncio
import contextlib
import sys
from asyncio.subprocess import PIPE, Process
from collections import Counter, deque
from collections.abc import Iterable
from pathlib import Path
from typing import Final, NoReturn

import orjson

import iveg
from iveg.adapters.recordings.writer import WriterSetup
from iveg.domain.errors import HopError

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
        started._waiting.append(setup.line())
        return started

    @property
    def pid(self) -> int:
        """Of the process."""
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
        """What became of inputs since it began."""
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
