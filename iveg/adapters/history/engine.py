"""Connections to the history database, the same behaviour on both kinds.

SQLite runs in WAL so that readers never wait for the writer; its driver's own hidden
transactions are turned off, so that a transaction begins where we say so.
"""

from pathlib import Path

import orjson
from sqlalchemy import URL, Engine, create_engine, event, make_url
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import ArgumentError
from sqlalchemy.pool import ConnectionPoolEntry, NullPool, Pool, QueuePool

from iveg.domain.errors import MissingExtraError, SettingsError

_BUSY_TIMEOUT_S = 5.0
_POSTGRESQL = {
    "connect_timeout": 5,
    "keepalives_idle": 5,
    "keepalives_interval": 2,
    "keepalives_count": 3,
    # A failed-over server goes silent; without this a commit waits for minutes.
    "tcp_user_timeout": 10_000,
    "application_name": "iveg",
}


def sqlite_url(file: Path) -> str:
    """The address of an SQLite file."""
    return URL.create("sqlite", database=str(file)).render_as_string()


def history_url(configured: str | None, data: Path) -> str:
    """The address that is configured, else that of a file in the data folder."""
    return configured or sqlite_url(data / "iveg.sqlite")


def sqlite_file(database_url: str) -> Path | None:
    """The file that an address names; None when it is a server's.

    Raises:
        SettingsError: not an address, or SQLite in memory, which forgets.
    """
    url = _parse(database_url)
    if url.get_backend_name() != "sqlite":
        return None
    if url.database in (None, "", ":memory:"):
        raise SettingsError("IVEG_DATABASE_URL", database_url, "a file for SQLite")
    return Path(str(url.database))


def describe(database_url: str) -> str:
    """The address for people and logs, without its password."""
    return _parse(database_url).render_as_string(hide_password=True)


def writing_engine(database_url: str) -> Engine:
    """For the one writer: its transactions take the write lock as they begin.

    ``BEGIN IMMEDIATE`` waits its turn at the start; a transaction that finds out
    half-way that it must write cannot wait at all.
    """
    # The connection stays open: whenever the last one closes, SQLite tidies up.
    return _engine(database_url, "BEGIN IMMEDIATE", "-c lock_timeout=5s", QueuePool)


def reading_engine(database_url: str) -> Engine:
    """For readers: short transactions, given up when they take too long."""
    # None idles: a file that was moved aside must not live on in one.
    return _engine(database_url, "BEGIN", "-c statement_timeout=20s", NullPool)


def _engine(database_url: str, begin: str, options: str, pool: type[Pool]) -> Engine:
    url = _parse(database_url)
    if url.get_backend_name() == "sqlite":
        engine = create_engine(_with_timeout(url), poolclass=pool)
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", lambda one: one.exec_driver_sql(begin))
        return engine
    try:
        return create_engine(
            url,
            pool_size=4,
            max_overflow=0,
            pool_timeout=5,
            pool_pre_ping=True,
            # NaN becomes null; PostgreSQL would refuse the row.
            json_serializer=lambda value: orjson.dumps(value).decode(),
            connect_args=_POSTGRESQL | {"options": options},
        )
    except ModuleNotFoundError as error:
        wanted = "psycopg", "postgresql"
        raise MissingExtraError("IVEG_DATABASE_URL", *wanted) from error


def _with_timeout(url: URL) -> URL:
    """Time to wait for a lock; the URL may set another: ``?timeout=0.5``."""
    if "timeout" in url.query:
        return url
    return url.update_query_dict({"timeout": str(_BUSY_TIMEOUT_S)})


def _prepare_sqlite(connection: DBAPIConnection, _: ConnectionPoolEntry) -> None:
    connection.isolation_level = None
    for pragma in (
        # Counts in a new file alone, and before anything is written to it.
        "auto_vacuum=INCREMENTAL",
        "journal_mode=WAL",
        "synchronous=NORMAL",
        "foreign_keys=ON",
    ):
        connection.cursor().execute(f"PRAGMA {pragma}")


def _parse(database_url: str) -> URL:
    try:
        url = make_url(database_url)
    except ArgumentError as error:
        raise SettingsError(
            "IVEG_DATABASE_URL", "(hidden)", "an SQLAlchemy address"
        ) from error
    if url.drivername in ("postgresql", "postgres"):
        return url.set(drivername="postgresql+psycopg")
    return url
