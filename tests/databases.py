"""A history of the newest shape that is made once in a process, and copied for a test.

All migrations take a fifth of a second of processor time, most tests have a database of
their own, and the migrations have tests of their own.
"""

from dataclasses import asdict
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy import insert

from iveg.adapters.history.engine import sqlite_file, upgrade
from iveg.adapters.history.recorder import Store
from iveg.adapters.history.tables import accounts, api_tokens
from iveg.domain.accounts import Account, ApiToken, name_key


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


def put_into_tables(url: str, person: Account, program: ApiToken) -> None:
    """Whom the version before has kept in the database."""
    named = {"name_key": name_key(person.name), "language": "es"}
    people = insert(accounts).values(**asdict(person) | named)
    named = {"name_key": name_key(program.name)}
    programs = insert(api_tokens).values(**asdict(program) | named)
    store = Store(url)
    store.run(lambda one: (one.execute(people), one.execute(programs)))
    store.close()
