"""A process that is fed with inputs on its standard input, as its feeder sees it.

It is started of one of our modules, told its setup in the first line, and answers in
lines of JSON.  It ends when its input does.
"""

import asyncio
import contextlib
import sys
from asyncio.subprocess import PIPE, Process
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar, NoReturn, Self

import orjson

import iveg
from iveg.domain.errors import HopError

PIECE_BYTES = 1 << 16
GRACE_S = 5.0
_GONE = OSError, RuntimeError
"""What a pipe says whose reader has ended; loops differ.  A timeout is an OSError."""
_BESIDE_IVEG = Path(iveg.__file__).parents[1]


class FedProcess:
    """One process, from its start to its end.

    Args:
        process: Just started, with pipes.

    Attributes:
        MODULE: What it runs; ``NAME`` the hop that its end is an error of, ``REFUSER``
            that of what it refuses.
    """

    MODULE: ClassVar[str]
    NAME: ClassVar[str]
    REFUSER: ClassVar[str]

    def __init__(self, process: Process) -> None:
        if process.stdin is None or process.stdout is None:
            raise ValueError("it needs both pipes")
        self._process = process
        self._inputs, self._answers = process.stdin, process.stdout
        self._waiting: deque[bytes] = deque()

    @classmethod
    async def spawn(cls, line: bytes, *args: Any) -> Self:
        """Start one; ``line`` is its setup, ``args`` follow the process.

        Raises:
            OSError: it does not start.
        """
        # In a session of its own Ctrl-C does not reach it: it ends when its input does.
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", cls.MODULE),
            stdin=PIPE,
            stdout=PIPE,
            cwd=_BESIDE_IVEG,
            start_new_session=True,
        )
        fed = cls(process, *args)
        fed._waiting.append(line)
        return fed

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    async def feed(self, packed: Iterable[bytes]) -> None:
        """Hand over inputs; waits for the pipe.

        Who is cancelled meanwhile hands over the rest the next time.  The end of the
        process is what ``listen`` tells.
        """
        self._waiting += packed
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
            answer = orjson.loads(line)
            refused = answer.pop("refused", "")
            if answer:
                self.heard(answer)
        code = await self._process.wait()
        self.ended()
        if refused:
            raise HopError(self.REFUSER, refused)
        raise HopError(self.NAME, f"its process has ended: {code}")

    def heard(self, counts: dict[str, int]) -> None:
        """It said something."""

    def ended(self) -> None:
        """It is over."""

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
