"""A history of the newest shape that is made once in a process, and copied for a test.

All migrations take a fifth of a second of processor time, most tests have a database of
their own, and the migrations have tests of their own.
"""

from dataclasses import asdict
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy import Connection, MetaData, Table, insert

from iveg.adapters.history.engine import sqlite_file, upgrade
from iveg.adapters.history.recorder import Store
from iveg.domain.accounts import Account, ApiToken, name_key
from iveg.domain.records import Record
from iveg.vital.record import Waiting


def lay_history(database_url: str) -> None:
    """Put an empty history where SQLite's will be; one that is there is kept."""
    file = sqlite_file(database_url)
    if file is not None and file.parent.is_dir() and not file.exists():
        file.write_bytes(_newest())


@cache
def _newest() -> bytes:
    with TemporaryDirectory() as folder:
        file = Path(folder, "history.sqlite")
        upgrade(f"sqlite:///{file}")
        return file.read_bytes()


def remember(database_url: str, *records: Record) -> None:
    """Put rows into a history."""
    store = Store(database_url)
    store.write([Waiting(one, number, 0.0) for number, one in enumerate(records, 1)])
    store.close()


def put_into_tables(url: str, person: Account, program: ApiToken) -> None:
    """Whom the version before has kept in the database."""
    store = Store(url)
    spoken = {"language": "es"}
    for name, row, more in (("accounts", person, spoken), ("api_tokens", program, {})):
        values = asdict(row) | {"name_key": name_key(row.name)} | more
        store.run(partial(_insert, name=name, values=values))
    store.close()


def _insert(connection: Connection, name: str, values: dict[str, object]) -> None:
    table = Table(name, MetaData(), autoload_with=connection)
    connection.execute(insert(table).values(**values))
