"""How long a test waits before it gives up: a busy machine is slow without being wrong.

What must be quick has a limit of its own.
"""

import asyncio
from collections.abc import Callable

PATIENCE_S = 120.0
PATIENCE_MS = 1000 * PATIENCE_S

AGAIN = 1
"""Requests of the driver's own: it keeps connections, and may write on one that the
server has just closed."""


async def until(holds: Callable[[], object]) -> None:
    """Ask again and again until it holds: for what has no event of its own."""
    async with asyncio.timeout(PATIENCE_S):
        while not holds():  # noqa: ASYNC110 - another thread or program does it
            await asyncio.sleep(0.02)
