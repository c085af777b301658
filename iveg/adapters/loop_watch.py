"""CPU of each turn of the loop, without that of other programs."""

import asyncio
from collections.abc import Callable

from iveg.adapters import clock

BEAT_S = 0.02


async def watch_loop(note: Callable[[float], None]) -> None:
    """Measure until cancelled.

    A beat is due every 20 ms.  A late beat was held up by one turn of the loop.  That
    turn took at most the CPU of the loop's thread since the beat before, and at least
    20 ms less.

    Args:
        note: Called with a lower bound of the CPU of the longest turn since a beat (s).
    """
    while True:
        began = clock.thread_cpu()
        await asyncio.sleep(BEAT_S)
        note(clock.thread_cpu() - began - BEAT_S)
