"""What is read from the database again and again, so that changes count at once."""

import asyncio
import contextlib
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from iveg.domain.errors import HopError

_T = TypeVar("_T")
EVERY_S = 0.4
"""Between two readings of who may come in (s)."""


class Rereading(ABC):
    """Reads in a thread of its own; while the database is away the last counts.

    Args:
        name: Of the thread.
    """

    def __init__(self, name: str) -> None:
        self._thread = ThreadPoolExecutor(1, name)

    @abstractmethod
    async def refresh(self) -> None:
        """Read once. Raises HopError."""

    async def run(self) -> None:
        """Read again and again, until cancelled."""
        while True:
            with contextlib.suppress(HopError):
                await self.refresh()
            await asyncio.sleep(EVERY_S)

    async def _apart(self, work: Callable[[], _T]) -> _T:
        """Have something done in the thread, one after the other."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)

    def close(self) -> None:
        """End the thread."""
        self._thread.shutdown(wait=False)
