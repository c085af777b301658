"""Work that goes apart, in a thread of the test instead of a process."""

import asyncio
from collections.abc import Callable
from typing import ParamSpec, TypeVar

_P = ParamSpec("_P")
_T = TypeVar("_T")


class FakeWorker:
    """As ``adapters.worker.Worker``, without a process."""

    async def run(
        self, work: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs
    ) -> _T:
        return await asyncio.to_thread(work, *args, **kwargs)
