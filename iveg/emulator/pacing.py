"""Doing something once a period, for ever."""

import asyncio
from collections.abc import Callable

from iveg.adapters import clock


async def every(period: float, work: Callable[[float], None]) -> None:
    """Call ``work`` with the time since its last call, once a period (s), for ever.

    A call that comes more than a period late moves the ones after it: nothing is made
    up for.
    """
    last = due = clock.now().mono
    while True:
        now = clock.now().mono
        work(now - last)
        last = now
        due = max(due + period, now)
        await asyncio.sleep(max(0.0, due - clock.now().mono))
