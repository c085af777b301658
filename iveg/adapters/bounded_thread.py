"""One thread beside the event loop for work that strangers may ask for.

One thread is the bound: a flood of sign-ins takes half a core at most, never the loop
on which a STOP runs.
"""

import asyncio
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Final, ParamSpec, TypeVar

from iveg.domain.errors import BusyError

_P = ParamSpec("_P")
_T = TypeVar("_T")
_MOST_WAITING: Final = 16
_NICENESS: Final = 10


class BoundedThread:
    """Does one thing after the other; at most sixteen wait.

    Args:
        name: Of the thread.
    """

    def __init__(self, name: str) -> None:
        self._thread = ThreadPoolExecutor(1, name, _step_back)
        self._waiting = 0

    async def run(
        self, work: Callable[_P, _T], *args: _P.args, **named: _P.kwargs
    ) -> _T:
        """What a call returns.

        Raises:
            BusyError: too many wait.
        """
        if self._waiting >= _MOST_WAITING:
            raise BusyError
        self._waiting += 1
        try:
            done = self._thread.submit(work, *args, **named)
            return await asyncio.wrap_future(done)
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """End the thread."""
        self._thread.shutdown(wait=False)


def _step_back() -> None:
    """Have the system serve the loop first; Linux alone has a niceness of threads."""
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
