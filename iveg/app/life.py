"""The life of the server's parts: vital ones share one fate, comfort has none.

A vital part that ends takes the process with it, after a last word to the fleet: a
server that is half alive would look as if it watched (docs/architecture.md, "Vital and
comfort").
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping

from iveg.domain.errors import VitalPartError
from iveg.vital.supervision import Supervision

_log = logging.getLogger(__name__)
Work = Callable[[], Awaitable[object]]
LAST_WORD_S = 0.5
"""Time that the last word may take; robots slow by themselves half a second later."""


async def live(
    vital: Mapping[str, Work],
    comfort: Mapping[str, Work],
    supervision: Supervision,
    last_word: Work,
) -> None:
    """Run all parts until cancelled.

    Args:
        vital: By name; none may end.
        comfort: By name; each is started again when it fails.
        supervision: Names what of comfort is down.
        last_word: Said to the fleet when a vital part has ended.

    Raises:
        VitalPartError: one has.
    """
    tasks = [asyncio.create_task(_run(work), name=name) for name, work in vital.items()]
    beside = [
        asyncio.create_task(supervision.keep_running(name, work), name=name)
        for name, work in comfort.items()
    ]
    try:
        ended, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        await _say(last_word)
        task = ended.pop()
        raise VitalPartError(task.get_name()) from task.exception()
    finally:
        for task in (*tasks, *beside):
            task.cancel()
        await asyncio.gather(*tasks, *beside, return_exceptions=True)


async def _run(work: Work) -> None:
    await work()


async def _say(last_word: Work) -> None:
    try:
        async with asyncio.timeout(LAST_WORD_S):
            await last_word()
    except Exception:
        # The part that would say it may be the one that has failed.
        _log.exception("the last feedback failed; robots slow by themselves")
