"""Parts of iVeg as processes of their own."""

import asyncio
import contextlib
import logging
import signal
import sys
from collections.abc import AsyncIterator, Coroutine, Mapping
from contextlib import asynccontextmanager
from typing import TypeVar

from iveg.domain.errors import HopError

_log = logging.getLogger(__name__)
_PATIENCE_S = 30.0
_GRACE_S = 5.0
T = TypeVar("T")


@asynccontextmanager
async def running_parts(environment: Mapping[str, str]) -> AsyncIterator["Parts"]:
    """Parts that end with the block, the newest first."""
    parts = Parts(environment)
    try:
        yield parts
    finally:
        while parts.running:
            await parts.stop_newest()


class Parts:
    """Running parts.

    Args:
        environment: Environment of all parts.

    Attributes:
        running: The parts' commands and processes, in the order of their start.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.running: list[tuple[str, asyncio.subprocess.Process]] = []
        self._environment = dict(environment)

    async def start(self, name: str, *words: str) -> None:
        """Start a part and wait until it reports that it is ready.

        Raises:
            SystemExit: it has ended first.
        """
        # A session of its own: Ctrl-C reaches this process alone, which stops the parts
        # in order, so that none logs the loss of another.
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "iveg", name, *words, "--until-eof"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            env=self._environment,
            start_new_session=True,
        )
        self.running.append((name, process))
        assert process.stdout is not None  # noqa: S101 - a pipe, as above
        line = b""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_PATIENCE_S):
                line = await process.stdout.readline()
        if line.strip() != b"ready":
            raise SystemExit(f"iveg: {name} did not start.")

    async def stop_newest(self) -> None:
        """End the part that was started last; one that hangs is killed."""
        _, process = self.running.pop()
        if process.returncode is not None:
            return
        process.send_signal(signal.SIGTERM)
        try:
            async with asyncio.timeout(_GRACE_S):
                await process.wait()
        except TimeoutError:
            _log.warning("process %d did not end and is killed", process.pid)
            process.kill()
            await process.wait()

    async def outlast(self, work: Coroutine[object, object, T]) -> T:
        """Run ``work`` while all parts run.

        Raises:
            HopError: a part has ended.
        """
        ends = {asyncio.create_task(part.wait()): name for name, part in self.running}
        main = asyncio.create_task(work)
        try:
            await asyncio.wait([main, *ends], return_when=asyncio.FIRST_COMPLETED)
            for end, name in ends.items():
                if end.done():
                    raise HopError(name, f"has ended (exit code {end.result()})")
            return await main
        finally:
            for task in (main, *ends):
                task.cancel()
            await asyncio.gather(main, *ends, return_exceptions=True)
