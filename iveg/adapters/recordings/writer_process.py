"""The process that writes recordings, as its feeder sees it."""

import asyncio
import contextlib
import sys
from asyncio.subprocess import PIPE, Process
from collections import Counter, deque
from collections.abc import Iterable
from pathlib import Path
from typing import NoReturn

import orjson

import iveg
from iveg.adapters.recordings.writer import WriterSetup
from iveg.domain.errors import HopError

PIECE_BYTES = 1 << 16
GRACE_S = 5.0
_GONE = OSError, RuntimeError
"""What a pipe says whose reader has ended; loops differ.  A timeout is an OSError."""
_MODULE = "iveg.adapters.recordings.writer"
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
            raise ValueError("a writer needs both pipes")
        self._process = process
        self._inputs, self._answers = process.stdin, process.stdout
        self._counters = counters
        self._waiting: deque[bytes] = deque()
        self._handed = 0
        self._answered: Counter[str] = Counter()

    @classmethod
    async def start(cls, setup: WriterSetup, counters: Counter[str]) -> "WriterProcess":
        """Start one.  Raises OSError."""
        # In a session of its own Ctrl-C does not reach it: it ends when its input does.
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", _MODULE),
            stdin=PIPE,
            stdout=PIPE,
            cwd=_BESIDE_IVEG,
            start_new_session=True,
        )
        writer = cls(process, counters)
        writer._waiting.append(setup.line())
        return writer

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    async def feed(self, packed: Iterable[bytes]) -> None:
        """Hand over inputs; waits for the pipe.

        Who is cancelled meanwhile hands over the rest the next time.  The end of the
        process is what ``listen`` tells.
        """
        inputs = list(packed)
        self._handed += len(inputs)
        self._waiting += inputs
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
        """Take what it says until it ends.

        Raises:
            HopError: always, with the reason why it ended.
        """
        refused = ""
        while line := await self._answers.readline():
            told = orjson.loads(line)
            refused = told.pop("refused", "")
            self._note(told)
        code = await self._process.wait()
        lost = self._handed - self._answered.total()
        self._handed -= lost
        self._counters["recordings_dropped"] += lost
        if refused:
            raise HopError("disk", refused)
        raise HopError("recordings", f"the process that writes has ended: {code}")

    def _note(self, told: dict[str, int]) -> None:
        """What became of inputs since it began."""
        fresh = Counter(told) - self._answered
        self._answered = Counter(told)
        for what, count in fresh.items():
            self._counters[f"recordings_{what}"] += count

    async def end(self, packed: Iterable[bytes]) -> None:
        """Have it write these, too, and finish; one that hangs is killed."""
        with contextlib.suppress(HopError, *_GONE):
            async with asyncio.timeout(GRACE_S):
                await self.feed(packed)
                self._inputs.close()
                await self.listen()
        if self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()
