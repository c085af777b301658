"""The history's reading side: queries of the REST API, and what earlier versions kept.

Every query runs in a thread of its own small pool, so that a long query neither holds
up the event loop nor takes the threads that a STOP's journal needs.  Accounts and
tokens of earlier versions are copied once; their tables stay for one version more.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any, Concatenate, ParamSpec, TypeVar

from sqlalchemy import (
    Connection,
    Engine,
    MetaData,
    RowMapping,
    Select,
    Table,
    select,
    text,
)
from sqlalchemy.exc import SQLAlchemyError

from iveg.adapters.history import lists
from iveg.adapters.history.engine import reading_engine, reason_of
from iveg.adapters.history.lists import Filter, ListOf, Page, R, record_of
from iveg.adapters.history.recorder import Store
from iveg.adapters.history.tables import (
    EARLIER,
    OPEN,
    alerts,
    command_events,
)
from iveg.domain.accounts import Access, Account, ApiToken
from iveg.domain.errors import HopError
from iveg.domain.records import (
    AlertRecord,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
)

P = ParamSpec("P")
T = TypeVar("T")


def ask(
    engine: Engine,
    question: Callable[Concatenate[Connection, P], T],
    *args: P.args,
    **named: P.kwargs,
) -> T:
    """The answer of a database.

    Raises:
        HopError: it does not answer.
    """
    try:
        with engine.connect() as connection:
            return question(connection, *args, **named)
    except SQLAlchemyError as error:
        raise HopError("database", reason_of(error)) from error


def ask_once(
    url: str,
    question: Callable[Concatenate[Connection, P], T],
    *args: P.args,
    **named: P.kwargs,
) -> T:
    """Answer of a database that is asked nothing else."""
    engine = reading_engine(url)
    try:
        return ask(engine, question, *args, **named)
    finally:
        engine.dispose()


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
        """Answer of a question, such as ``series_of`` of ``series``."""
        work = partial(ask, self._engine, question, *args, **named)
        return await asyncio.get_running_loop().run_in_executor(self._threads, work)

    async def page(self, listed: ListOf[R], wanted: Filter) -> Page[R]:
        """One page of a list."""
        return await self.ask(lists.read_page, listed, wanted)

    async def pages(
        self, listed: ListOf[R], first: Page[R], wanted: Filter
    ) -> AsyncIterator[Sequence[R]]:
        """Rows of the first page that was asked for so, and of all after it."""
        page = first
        yield page.items
        while page.next is not None:
            page = await self.page(listed, replace(wanted, cursor=page.next))
            yield page.items

    async def one(self, listed: ListOf[R], key: str) -> R | None:
        """The record of that key; None when it is not known."""
        wanted = select(listed.table).where(listed.key == key)
        return next(iter(await self.ask(_records, listed.kind, wanted)), None)

    async def open_commands(self) -> tuple[CommandRecord, ...]:
        """Commands that still go on, oldest first."""
        return await self._open(lists.COMMANDS)

    async def open_decisions(self) -> tuple[DecisionRecord, ...]:
        """Decisions without an end, oldest first."""
        return await self._open(lists.DECISIONS)

    async def open_alerts(self) -> tuple[AlertRecord, ...]:
        """Active alerts, oldest first."""
        return await self._open(lists.ALERTS)

    async def _open(self, listed: ListOf[R]) -> tuple[R, ...]:
        is_open = select(listed.table).where(OPEN[listed.table])
        wanted = is_open.order_by(listed.at, listed.key)
        return await self.ask(_records, listed.kind, wanted)

    async def unseen_alerts(self, most: int) -> tuple[AlertRecord, ...]:
        """The newest P1s that nobody has acknowledged, active or over."""
        a = alerts.c
        unseen = select(alerts).where(a.priority == "P1", a.acknowledged_at.is_(None))
        wanted = unseen.order_by(a.last_raised_at.desc(), a.alert_id.desc()).limit(most)
        return await self.ask(_records, AlertRecord, wanted)

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


def earlier_access(url: str) -> Access | None:
    """Rows that are still to be copied; None after that. Raises HopError."""
    return ask_once(url, _read)


def mark_moved(url: str, now: float) -> None:
    """Note that all is copied (Unix s). Raises HopError."""
    mark = text("INSERT INTO access_moved (at) VALUES (:at)")
    store = Store(url)
    try:
        store.run(lambda one: one.execute(mark, {"at": now}))
    finally:
        store.close()


def _read(connection: Connection) -> Access | None:
    people, programs, moved = (
        Table(name, MetaData(), autoload_with=connection) for name in EARLIER
    )
    if connection.execute(select(moved)).first() is not None:
        return None
    return Access(
        tuple(Account(**row) for row in _rows(connection, people)),
        tuple(ApiToken(**row) for row in _rows(connection, programs)),
    )


def _rows(connection: Connection, table: Table) -> Sequence[RowMapping]:
    known = (one for one in table.c if one.key not in ("name_key", "language"))
    return connection.execute(select(*known)).mappings().all()
