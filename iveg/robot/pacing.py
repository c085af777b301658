"""Periodic calls."""

import asyncio
import itertools
from collections.abc import Callable, Sequence

from iveg.adapters import clock

SLOTS = 3
"""A robot's period has one each for drive and odometry, laser, camera."""
LONGEST_STEP_S = 0.1
"""Longest time step (s), so that a suspended machine moves no robot by a jump."""


async def every(period: float, work: Callable[[float], None]) -> None:
    """Call ``work`` with the time since its last call, once a period (s), for ever.

    A call more than a period late moves the later ones: missed calls are not repeated.
    """
    last = due = clock.mono()
    while True:
        now = clock.mono()
        work(now - last)
        last = now
        due = max(due + period, now)
        await asyncio.sleep(max(0.0, due - clock.mono()))


async def in_slots(period: float, work: Sequence[Callable[[float], None]]) -> None:
    """Call each of ``work`` once a period (s), evenly spaced, for ever."""
    slots = itertools.cycle(work)
    await every(period / len(work), lambda dt: next(slots)(dt))
