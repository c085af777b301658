"""The history's reading side: queries of the REST API.

Every query runs in a thread of its own small pool, so that a long query neither holds
up the event loop nor takes the threads that a STOP's journal needs.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, Concatenate

from sqlalchemy import Connection, Select, func, select

from iveg.adapters.history import listings, lists
from iveg.adapters.history.asking import P, T, ask
from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.listings import ListOf, R
from iveg.adapters.history.lists import Filter, Page, record_of
from iveg.adapters.history.tables import (
    alerts,
    command_events,
    commands,
    decisions,
    is_open_command,
    latency,
)
from iveg.domain.records import (
    AlertRecord,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
    LatencyRecord,
    LogRecord,
)

_THREADS = 4


class Queries:
    """Reads the history.

    Every method raises ``HopError`` when the database does not answer.

    Attributes:
        url: The database, for a process that asks it itself.
    """

    def __init__(self, database_url: str) -> None:
        self.url = database_url
        self._engine = reading_engine(database_url)
        self._threads = ThreadPoolExecutor(_THREADS, "history-read")

    async def ask(
        self,
        question: Callable[Concatenate[Connection, P], T],
        *args: P.args,
        **named: P.kwargs,
    ) -> T:
        """What a question finds, as ``speed_series`` of ``series``."""

        def asked() -> T:
            return ask(self._engine, question, *args, **named)

        return await asyncio.get_running_loop().run_in_executor(self._threads, asked)

    async def page(self, of: ListOf[R], asked: Filter) -> Page[R]:
        """One page of a list."""
        return await self.ask(lists.read_page, of, asked)

    async def pages(
        self, of: ListOf[R], first: Page[R], asked: Filter
    ) -> AsyncIterator[Sequence[R]]:
        """Rows of the first page that was asked for so, and of all after it."""
        page = first
        yield page.items
        while page.next is not None:
            page = await self.page(of, replace(asked, cursor=page.next))
            yield page.items

    async def one(self, of: ListOf[R], key: str) -> R | None:
        """The record of that key; None when it is not known."""
        wanted = select(of.table).where(of.key == key)
        return next(iter(await self.ask(_records, of.kind, wanted)), None)

    async def open_commands(self) -> tuple[CommandRecord, ...]:
        """Commands whose last row says that they still go on, oldest first."""
        c = commands.c
        wanted = (
            select(commands)
            .where(is_open_command())
            .order_by(c.requested_at, c.command_id)
        )
        return await self.ask(_records, CommandRecord, wanted)

    async def open_decisions(self) -> tuple[DecisionRecord, ...]:
        """Decisions whose last row has no end."""
        wanted = select(decisions).where(decisions.c.ended_at.is_(None))
        return await self.ask(_records, DecisionRecord, wanted)

    async def open_alerts(self) -> tuple[AlertRecord, ...]:
        """Alerts whose last row says that they are active."""
        wanted = select(alerts).where(alerts.c.cleared_at.is_(None))
        return await self.ask(_records, AlertRecord, wanted)

    async def unseen_alerts(self, most: int) -> tuple[AlertRecord, ...]:
        """The newest P1s that nobody has acknowledged, active or over."""
        a = alerts.c
        wanted = (
            select(alerts)
            .where(a.priority == "P1", a.acknowledged_at.is_(None))
            .order_by(a.last_raised_at.desc(), a.alert_id.desc())
            .limit(most)
        )
        return await self.ask(_records, AlertRecord, wanted)

    async def drills(
        self, robot: str | None = None, most: int = 100
    ) -> tuple[CommandRecord, ...]:
        """The newest STOP drills, newest first."""
        c = commands.c
        wanted = (
            select(commands)
            .where(c.drill)
            .order_by(c.requested_at.desc(), c.command_id.desc())
            .limit(most)
        )
        if robot is not None:
            wanted = wanted.where(c.robot_id == robot)
        return await self.ask(_records, CommandRecord, wanted)

    async def last_drills(self) -> dict[str, float]:
        """Robot → when its last drill that ended in a standstill was asked (Unix s)."""
        c = commands.c
        newest = (
            select(c.robot_id, func.max(c.requested_at))
            .where(c.drill, c.standing_at.is_not(None))
            .group_by(c.robot_id)
        )
        return await self.ask(
            lambda connection: {row[0]: row[1] for row in connection.execute(newest)}
        )

    async def command_events(self, command_id: str) -> tuple[CommandEventRecord, ...]:
        """The audit trail of a command, oldest first."""
        steps = await self.steps_of([command_id])
        return tuple(steps.get(command_id, ()))

    async def steps_of(
        self, command_ids: Sequence[str]
    ) -> dict[str, list[CommandEventRecord]]:
        """The audit trails of some commands, each oldest first."""
        events = command_events.c
        wanted = (
            select(command_events)
            .where(events.command_id.in_(command_ids))
            .order_by(events.at, events.row_id)
        )
        steps: dict[str, list[CommandEventRecord]] = {}
        for step in await self.ask(_records, CommandEventRecord, wanted):
            steps.setdefault(step.command_id, []).append(step)
        return steps

    async def newest_lines(self, most: int) -> tuple[LogRecord, ...]:
        """The newest lines of the log, newest first."""
        return (await self.page(listings.LOG, Filter(limit=most))).items

    async def latency_minutes(self, since: float) -> tuple[LatencyRecord, ...]:
        """Every minute of every hop from then on (Unix s), oldest first."""
        c = latency.c
        wanted = select(latency).where(c.at >= since).order_by(c.at, c.row_id)
        return await self.ask(_records, LatencyRecord, wanted)

    def close(self) -> None:
        """Let go of threads and connections."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._engine.dispose()


def _records(
    connection: Connection, kind: type[R], wanted: Select[Any]
) -> tuple[R, ...]:
    """The rows that a statement finds, as records in its order."""
    rows = connection.execute(wanted).mappings()
    return tuple(record_of(kind, row) for row in rows)
