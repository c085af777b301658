"""CPU of each turn of the loop, whatever else the machine does."""

import asyncio
from collections.abc import Callable

from iveg.adapters import clock

BEAT_S = 0.02


async def watch_loop(
    note: Callable[[float], None], read_cpu: Callable[[], float] = clock.thread_cpu
) -> None:
    """Measure until cancelled.

    A beat comes due every 20 ms.  What it finds late was held up by one turn, whose CPU
    is that of the loop's thread since the beat before, less those 20 ms at most.

    Args:
        note: Called with the CPU that the longest turn since a beat took (s).
        read_cpu: Reads the CPU that the calling thread has used (s).
    """
    while True:
        began = read_cpu()
        await asyncio.sleep(BEAT_S)
        note(read_cpu() - began - BEAT_S)
