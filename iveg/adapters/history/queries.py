"""The history's reading side: queries of the REST API, and tables of earlier versions.

Queries run in a small pool of threads, so that a long query neither holds up the event
loop nor takes the thread of the STOP's journal.  Accounts and tokens of earlier
versions are copied once; their tables stay for one more version.
"""

import asyncio
import math
from collections.abc import AsyncIterator, Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
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
from iveg.domain.alerts import MOST_KEPT
from iveg.domain.errors import HopError
from iveg.domain.records import (
    AlertRecord,
    CommandEventRecord,
)

P = ParamSpec("P")
T = TypeVar("T")


def ask(
    engine: Engine,
    question: Callable[Concatenate[Connection, P], T],
    *args: P.args,
    **named: P.kwargs,
) -> T:
    """Answer of a database to a question.

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
    """Answer of a database to a single question, over a connection of its own."""
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
        url: Address of the database, for other processes.
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
        """Answer to a question, such as ``series_of`` of ``series``."""
        work = partial(ask, self._engine, question, *args, **named)
        return await asyncio.wrap_future(self._threads.submit(work))

    async def page(self, listed: ListOf[R], wanted: Filter) -> Page[R]:
        """One page of a list."""
        return await self.ask(lists.read_page, listed, wanted)

    async def pages(
        self, listed: ListOf[R], first: Page[R], wanted: Filter
    ) -> AsyncIterator[Sequence[R]]:
        """Rows of the page ``first``, and of all pages after it."""
        page = first
        yield page.items
        while page.next is not None:
            page = await self.page(listed, replace(wanted, cursor=page.next))
            yield page.items

    async def rows(
        self, listed: ListOf[R], wanted: Filter, most: float = math.inf
    ) -> list[R]:
        """Rows of a list, newest first, up to the page that reaches ``most``."""
        rows: list[R] = []
        async for page in self.pages(listed, await self.page(listed, wanted), wanted):
            rows += page
            if len(rows) >= most:
                break
        return rows

    async def get(self, listed: ListOf[R], key: str) -> R | None:
        """The record with this key; None where it is unknown."""
        statement = select(listed.table).where(listed.key == key)
        return next(iter(await self.ask(_records, listed.kind, statement)), None)

    async def left_open(self, listed: ListOf[R]) -> tuple[R, ...]:
        """Open commands, decisions or alerts (``OPEN``), oldest first."""
        statement = (
            select(listed.table)
            .where(OPEN[listed.table])
            .order_by(listed.at, listed.key)
        )
        return await self.ask(_records, listed.kind, statement)

    async def unseen_alerts(self) -> tuple[AlertRecord, ...]:
        """The newest unacknowledged P1 alerts, active or cleared."""
        a = alerts.c
        newest = (
            select(alerts)
            .where(a.priority == "P1", a.acknowledged_at.is_(None))
            .order_by(a.last_raised_at.desc(), a.alert_id.desc())
        )
        return await self.ask(_records, AlertRecord, newest.limit(MOST_KEPT))

    async def steps_of(
        self, command_ids: Sequence[str]
    ) -> dict[str, list[CommandEventRecord]]:
        """Steps of some commands, oldest first."""
        events = command_events.c
        statement = (
            select(command_events)
            .where(events.command_id.in_(command_ids))
            .order_by(events.at, events.row_id)
        )
        steps: dict[str, list[CommandEventRecord]] = {}
        for step in await self.ask(_records, CommandEventRecord, statement):
            steps.setdefault(step.command_id, []).append(step)
        return steps

    def close(self) -> None:
        """End threads and close connections."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._engine.dispose()


def _records(
    connection: Connection, kind: type[R], wanted: Select[Any]
) -> tuple[R, ...]:
    """Rows of a statement, as records in its order."""
    return tuple(record_of(kind, row) for row in connection.execute(wanted).mappings())


def earlier_access(url: str) -> Access | None:
    """Accounts and tokens to be copied; None once they are.  Raises HopError."""
    return ask_once(url, _read)


def mark_moved(url: str, now: float) -> None:
    """Note the time at which all was copied (Unix s).  Raises HopError."""
    mark = text("INSERT INTO access_moved (at) VALUES (:at)")
    with closing(Store(url)) as store:
        store.run(lambda connection: connection.execute(mark, {"at": now}))


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
    # `Account` and `ApiToken` have neither of these columns any more.
    columns = (c for c in table.c if c.key not in ("name_key", "language"))
    return connection.execute(select(*columns)).mappings().all()
