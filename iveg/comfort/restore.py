"""Open rows of earlier runs in the history, taken up while STOP already works.

A P1 that nobody acknowledged stays active, the log continues, and rows that a crash
left open are closed.  Nothing waits for this: until the history answers the page says
that earlier alerts are unknown.
"""

import asyncio
from collections.abc import Sequence
from typing import Protocol

from iveg.comfort.goals import GoalDispatcher
from iveg.domain.alerts import MOST_KEPT, read_alert
from iveg.domain.errors import HopError
from iveg.domain.records import (
    AlertRecord,
    CommandRecord,
    DecisionRecord,
    LogRecord,
)
from iveg.vital.command import Commander
from iveg.vital.core import Core
from iveg.vital.evaluate import Evaluator

LINES = 200
"""Lines of the log that come back."""
_AGAIN_S = 5.0


class History(Protocol):
    """Questions to the history; each raises HopError while it does not answer."""

    async def open_commands(self) -> Sequence[CommandRecord]:
        """Commands without an end."""

    async def open_decisions(self) -> Sequence[DecisionRecord]:
        """Decisions without an end."""

    async def open_alerts(self) -> Sequence[AlertRecord]:
        """Alerts that were active."""

    async def unseen_alerts(self, most: int) -> Sequence[AlertRecord]:
        """The newest P1s that nobody acknowledged."""

    async def newest_lines(self, most: int) -> Sequence[LogRecord]:
        """The newest lines of the log."""


async def remember(
    history: History,
    core: Core,
    commander: Commander,
    goals: GoalDispatcher,
    evaluator: Evaluator,
) -> None:
    """Ask until the history answers; returns when all of it is taken up."""
    while True:
        try:
            left_open = await history.open_commands()
            decisions = await history.open_decisions()
            alerted = await history.open_alerts()
            unseen = await history.unseen_alerts(MOST_KEPT)
            lines = await history.newest_lines(LINES)
        except HopError:
            await asyncio.sleep(_AGAIN_S)
            continue
        now = core.ports.clock()
        commander.close_earlier(left_open, now)
        goals.close_earlier(left_open, now)
        evaluator.close_earlier(decisions, alerted, now)
        evaluator.alerts.remember(read_alert(one, now) for one in unseen)
        core.event_log.recall(lines)
        core.health_monitor.earlier_read = True
        return
