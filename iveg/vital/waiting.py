"""Waiting for an event with a time limit, at less cost than ``asyncio.timeout``."""

import asyncio


async def wait_set(event: asyncio.Event, timeout_s: float | None) -> None:
    """Wait until an event is set, at most ``timeout_s`` (s), and clear it."""
    if not event.is_set():
        loop = asyncio.get_running_loop()
        timer = None if timeout_s is None else loop.call_later(timeout_s, event.set)
        try:
            await event.wait()
        finally:
            if timer is not None:
                timer.cancel()
    event.clear()
