"""Work that goes apart, in a thread of the test instead of a process."""

import asyncio
from collections.abc import Callable
from typing import Any, TypeVar

from iveg.adapters.worker import Worker

_T = TypeVar("_T")


class FakeWorker(Worker):
    """A worker that starts no process."""

    async def run(self, work: Callable[..., _T], *args: Any, **kwargs: Any) -> _T:
        return await asyncio.to_thread(work, *args, **kwargs)
