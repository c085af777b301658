"""The longest turn of the loop, in CPU."""

import asyncio

from iveg.adapters import clock
from iveg.adapters.loop_watch import BEAT_S, watch_loop

LONG_S = 0.3


async def test_f63_a_long_turn_is_noted_with_its_cpu() -> None:
    noted: asyncio.Queue[float] = asyncio.Queue()
    watching = asyncio.create_task(watch_loop(noted.put_nowait))
    await asyncio.sleep(2 * BEAT_S)
    until = clock.thread_cpu() + LONG_S
    while clock.thread_cpu() < until:
        sum(range(1000))
    async with asyncio.timeout(30):
        while await noted.get() < LONG_S - 2 * BEAT_S:
            """A turn of the watch alone."""
    watching.cancel()
