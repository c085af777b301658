"""Asynchronous helpers beside synchronous tests: a loop in a thread of its own."""

import asyncio
import contextlib
import threading
from collections.abc import Coroutine, Iterator
from typing import Any

_ENDS_WITHIN_S = 10.0


@contextlib.contextmanager
def running(work: Coroutine[Any, Any, None], name: str) -> Iterator[None]:
    """Some work that goes on as long as the block, and is cancelled at its end."""
    loop = asyncio.new_event_loop()
    task = loop.create_task(work)

    def run() -> None:
        with contextlib.suppress(asyncio.CancelledError):
            loop.run_until_complete(task)

    thread = threading.Thread(target=run, name=name)
    thread.start()
    try:
        yield
    finally:
        loop.call_soon_threadsafe(task.cancel)
        thread.join(_ENDS_WITHIN_S)
        loop.close()
