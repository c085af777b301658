"""Rows that people call by name, each change of them with its row of the audit."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Generic, TypeVar

from sqlalchemy import Connection, Table, insert, select
from sqlalchemy.exc import IntegrityError

from iveg.adapters import clock
from iveg.adapters.history.asking import ask
from iveg.adapters.history.audit import write_audit
from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.store import Store
from iveg.adapters.ids import new_id
from iveg.domain.accounts import Account, ApiToken, name_key
from iveg.domain.audit import Actor, act_of
from iveg.domain.errors import NameTakenError
from iveg.domain.passkeys import Passkey
from iveg.domain.records import Json

R = TypeVar("R", Account, ApiToken, Passkey)


class KeyedRows(Generic[R]):
    """Reads rows of one table; blocks, so a server calls it in a thread.

    Every method raises ``HopError`` when the database does not answer.

    Args:
        database_url: Of the history.
        table: Its columns are the fields of a row, and maybe ``name_key``.
        kind: Of a row.
        key: The field by which they are read.
    """

    def __init__(
        self, database_url: str, table: Table, kind: type[R], key: str
    ) -> None:
        self._store = Store(database_url)
        self._reading = reading_engine(database_url)
        self._table, self._key = table, key
        self._kind: type[R] = kind
        self._columns = [one for one in table.c if one.key != "name_key"]

    def read(self) -> Mapping[str, R]:
        """All rows, by their key."""
        return ask(self._reading, self._rows)

    def _rows(self, connection: Connection) -> Mapping[str, R]:
        rows = connection.execute(select(*self._columns)).mappings()
        return {row[self._key]: self._kind(**row) for row in rows}

    def close(self) -> None:
        """Let go of the connections."""
        self._store.close()
        self._reading.dispose()


class NamedRows(KeyedRows[R]):
    """Adds rows, too, of which no two share a ``name_key``."""

    def _add(self, row: R, by: Actor, action: str, details: Json) -> None:
        """Keep a new row.

        Raises:
            NameTakenError: one is called so already.
        """
        self._store.run(
            lambda connection: add_row(
                connection, self._table, row, by, action, details
            )
        )


def add_row(
    connection: Connection, table: Table, row: R, by: Actor, action: str, details: Json
) -> None:
    """Keep a new row, with that of the audit.

    Raises:
        NameTakenError: one is called so already.
    """
    values = asdict(row) | {"name_key": name_key(row.name)}
    try:
        with connection.begin_nested():
            connection.execute(insert(table).values(**values))
    except IntegrityError as error:
        raise NameTakenError(row.name) from error
    note_change(connection, by, action, row.name, details)


def note_change(
    connection: Connection, by: Actor, action: str, name: str, details: Json
) -> None:
    """Write a change of somebody's rights into the audit, in the same transaction."""
    now = clock.wall()
    act = act_of(by, action, name, details, audit_id=new_id(), at=now)
    write_audit(connection, [act], now)
