"""One process beside the server, for work that would hold up its loop.

Sheets, charts and exports take seconds of CPU, and a thread would still compete with
the loop for the interpreter.  The process begins with the first call, ends with the
server, and is replaced where it died or took too long.  Calls wait in a short queue.
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
"""Calls that wait or run; another is refused."""
LIMIT_S, PACK_LIMIT_S = 60.0, 240.0
"""Time limit of a call (s); a browser prints the pages of an incident pack."""
_NAME = "worker"
_P = ParamSpec("_P")
_T = TypeVar("_T")


class Worker:
    """Runs functions of modules, with arguments that can be pickled.

    Args:
        failed: Called in the loop with the error of a failed process.
        limit_s: Time limit of a call (s); then the process is killed.
    """

    def __init__(
        self,
        failed: Callable[[Exception], None] | None = None,
        limit_s: float = LIMIT_S,
    ) -> None:
        self._failed = failed
        self._limit_s = limit_s
        # The thread pickles values and waits for the process; the loop does neither.
        self._thread = ThreadPoolExecutor(1, _NAME)
        self._process: SpawnProcess | None = None
        self._line: Connection | None = None
        self._waiting = 0

    async def run(
        self, work: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs
    ) -> _T:
        """Run ``work`` in the other process, and return its result.

        Raises:
            HopError: ``work`` raised it, the process died or took too long, or too many
                calls wait already.
        """
        if self._waiting >= MOST_WAITING:
            raise HopError(_NAME, "too much is asked at once")
        self._waiting += 1
        try:
            future = self._thread.submit(self._ask, work, args, kwargs)
            return await asyncio.wrap_future(future)
        except HopError as error:
            if error.hop == _NAME and self._failed is not None:
                self._failed(error)
            raise
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """Kill the process, also in the middle of a call."""
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
        # Spawned: a fork would copy locks that threads hold, and nobody frees them.
        context = multiprocessing.get_context("spawn")
        server_end, process_end = context.Pipe()
        process = context.Process(
            target=_serve, args=(process_end,), name="iveg-worker", daemon=True
        )
        process.start()
        # The process has its own end: a copy open here would hide its death.
        process_end.close()
        self._line, self._process = server_end, process
        return server_end

    def _end(self) -> None:
        line, self._line = self._line, None
        process, self._process = self._process, None
        # Killed first: a process whose line is closed would log that before it ends.
        if process is not None:
            process.kill()
            process.join()
        if line is not None:
            line.close()


def _serve(line: Connection) -> None:
    """Answer calls until the server is gone; the server handles Ctrl-C."""
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
    """Run a call; returns result, failed hop and detail, pickled."""
    try:
        return pickle.dumps((work(*args, **kwargs), "", ""))
    except HopError as error:
        return pickle.dumps((None, error.hop, error.detail))
    except Exception as error:
        return pickle.dumps((None, _NAME, repr(error)))
