"""One process beside the server, for work that would hold up its loop.

Sheets, charts and exports take seconds of CPU, and a thread would still fight the loop
for the interpreter.  The process begins with the first question, ends with the server,
and is made anew where it died or took too long.  Questions wait in one short line.
"""

import asyncio
import multiprocessing
import pickle
import signal
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import ParamSpec, TypeVar

from iveg.adapters.files import give_way
from iveg.domain.errors import HopError

MOST_WAITING = 16
"""Questions that wait or are worked on; one more is refused."""
LIMIT_S, PACK_LIMIT_S = 60.0, 240.0
"""Time that one may take; a pack has its pages printed by a browser."""
_NAME = "worker"
_P = ParamSpec("_P")
_T = TypeVar("_T")


class Worker:
    """Runs functions of modules, with values that can be pickled.

    Args:
        failed: Told that the process failed; called in the loop.
        limit_s: Time that one call may take; then the process is killed.
    """

    def __init__(
        self,
        failed: Callable[[Exception], None] | None = None,
        limit_s: float = LIMIT_S,
    ) -> None:
        self._failed = failed
        self._limit_s = limit_s
        # A thread waits for the process, and pickles values.
        self._thread = ThreadPoolExecutor(1, _NAME)
        self._process: SpawnProcess | None = None
        self._line: Connection | None = None
        self._waiting = 0

    async def run(
        self, work: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs
    ) -> _T:
        """Run ``work`` in the other process, and return its result.

        Raises:
            HopError: it raised one, the process died or took too long, or too many
                wait already.
        """
        if self._waiting >= MOST_WAITING:
            raise HopError(_NAME, "too much is asked at once")
        self._waiting += 1
        try:
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(
                self._thread, self._ask, work, args, kwargs
            )
        except HopError as error:
            if error.hop == _NAME and self._failed is not None:
                self._failed(error)
            raise
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """End the process, whatever it does."""
        self._thread.shutdown(wait=False, cancel_futures=True)
        self._end()

    # --- in the thread ------------------------------------------------------------

    def _ask(
        self,
        work: Callable[..., _T],
        args: Sequence[object],
        kwargs: Mapping[str, object],
    ) -> _T:
        if self._process is not None and not self._process.is_alive():
            self._end()
        line = self._line or self._begin()
        try:
            line.send((work, args, kwargs))
            if not line.poll(self._limit_s):
                raise EOFError("took too long")
            result: _T
            result, hop, detail = line.recv()
        except (EOFError, OSError) as error:
            self._end()
            raise HopError(_NAME, f"ended: {error}") from error
        if hop:
            raise HopError(hop, detail)
        return result

    def _begin(self) -> Connection:
        # Spawned: a copy of this process would have its threads' locks, for ever.
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(
            target=_serve, args=(theirs,), name="iveg-worker", daemon=True
        )
        process.start()
        # The process has its own: ours open would hide that it has died.
        theirs.close()
        self._line, self._process = ours, process
        return ours

    def _end(self) -> None:
        line, self._line = self._line, None
        process, self._process = self._process, None
        # A process whose line is closed would say so in the log before it dies.
        if process is not None:
            process.kill()
            process.join()
        if line is not None:
            line.close()


def _serve(line: Connection) -> None:
    """Answer until the server is gone; Ctrl-C is the server's to heed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    give_way()
    with suppress(EOFError):
        while True:
            line.send_bytes(_answer(*line.recv()))


def _answer(
    work: Callable[..., object],
    args: Sequence[object],
    kwargs: Mapping[str, object],
) -> bytes:
    """Result, hop that failed and its detail, pickled."""
    try:
        return pickle.dumps((work(*args, **kwargs), "", ""))
    except HopError as error:
        return pickle.dumps((None, error.hop, error.detail))
    except Exception as error:
        return pickle.dumps((None, _NAME, repr(error)))
