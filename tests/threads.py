"""Asynchronous helpers beside synchronous tests: a loop in a thread of its own."""

import asyncio
import contextlib
import threading
from collections.abc import Coroutine, Iterator
from queue import Queue
from typing import Any

_ENDS_WITHIN_S = 30.0


@contextlib.contextmanager
def running(work: Coroutine[Any, Any, None], name: str) -> Iterator[None]:
    """Some work that goes on as long as the block, and is cancelled at its end."""
    begun: Queue[tuple[asyncio.AbstractEventLoop, asyncio.Task[None]]] = Queue()

    def run() -> None:
        # At its end a runner also ends what the work has begun, connections first.
        with asyncio.Runner() as runner, contextlib.suppress(asyncio.CancelledError):
            loop = runner.get_loop()
            task = loop.create_task(work)
            begun.put((loop, task))
            loop.run_until_complete(task)

    thread = threading.Thread(target=run, name=name)
    thread.start()
    loop, task = begun.get()
    try:
        yield
    finally:
        loop.call_soon_threadsafe(task.cancel)
        thread.join(_ENDS_WITHIN_S)
