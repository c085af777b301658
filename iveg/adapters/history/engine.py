"""Connections to the history database, and its migrations; the same on both kinds.

SQLite uses a rollback journal: WAL maps a file into memory, and a program that cuts
that file ends every process that has mapped it.  So readers wait for the commit of a
batch.  The driver's hidden transactions are off: the code begins each transaction.

The migrations lie beside the package in a checkout and inside it when installed.  Each
start calls ``upgrade``: nothing to do costs a few milliseconds.
"""

import logging
import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import orjson
from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url, text
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import ArgumentError, DatabaseError, OperationalError
from sqlalchemy.pool import ConnectionPoolEntry, NullPool, Pool, QueuePool

import iveg
from iveg.adapters import clock
from iveg.adapters.files import make_private
from iveg.domain.errors import DataFileError, HopError, MissingExtraError, SettingsError

_BUSY_TIMEOUT_S = 5.0
_BESIDE = "-journal", "-wal", "-shm"
_POSTGRESQL = {
    "connect_timeout": 5,
    "keepalives_idle": 5,
    "keepalives_interval": 2,
    "keepalives_count": 3,
    # A failed-over server goes silent; without these values a commit waits for minutes.
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
        SettingsError: not an address, or SQLite in memory, which keeps nothing.
    """
    url = _parse(database_url)
    if url.get_backend_name() != "sqlite":
        return None
    if url.database in (None, "", ":memory:"):
        raise SettingsError("IVEG_DATABASE_URL", database_url, "a file for SQLite")
    return Path(str(url.database))


def writing_engine(database_url: str) -> Engine:
    """Engine of the one writer: its transactions take the write lock as they begin.

    ``BEGIN IMMEDIATE`` waits for the lock at the start.  A transaction that first reads
    and then writes could not wait for it.
    """
    engine = _engine(database_url, "BEGIN IMMEDIATE", "-c lock_timeout=5s", QueuePool)
    if engine.dialect.name == "sqlite":
        event.listen(engine, "connect", _leave_wal)
    return engine


def reading_engine(database_url: str) -> Engine:
    """Engine of readers: short transactions, which end when they take too long."""
    # No idle connections: they would go on reading a file that was moved aside.
    return _engine(database_url, "BEGIN", "-c statement_timeout=20s", NullPool)


def _engine(database_url: str, begin: str, options: str, pool: type[Pool]) -> Engine:
    url = _parse(database_url)
    if url.get_backend_name() == "sqlite":
        # Time to wait for a lock (s); an address may set another.
        url = url.set(query={"timeout": str(_BUSY_TIMEOUT_S), **url.query})
        engine = create_engine(url, poolclass=pool)
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", lambda c: c.exec_driver_sql(begin))
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
        library_and_extra = "psycopg", "postgresql"
        raise MissingExtraError("IVEG_DATABASE_URL", *library_and_extra) from error


def _prepare_sqlite(connection: DBAPIConnection, _: ConnectionPoolEntry) -> None:
    connection.isolation_level = None
    connection.cursor().execute("PRAGMA foreign_keys=ON")


def _leave_wal(connection: DBAPIConnection, _: ConnectionPoolEntry) -> None:
    """Convert a file that an earlier version wrote in WAL mode."""
    connection.cursor().execute("PRAGMA journal_mode=DELETE")


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


_log = logging.getLogger(__name__)
_CHECK_LIMIT_S = 5.0
_STEPS_BETWEEN_LOOKS = 100_000
_ONE_AT_A_TIME = 0x69566567
"""PostgreSQL lock (any fixed number) that lets one start upgrade at a time."""


def upgrade(database_url: str) -> None:
    """Make the database fit to be written; a corrupt SQLite file is moved aside.

    Raises:
        DataFileError: it was written by a newer iVeg, or a migration broke off in it.
        HopError: it cannot be reached.
        SettingsError: the address cannot be used.
    """
    file = sqlite_file(database_url)
    if file is not None:
        _prepare_file(file)
    engine = writing_engine(database_url)
    try:
        with engine.connect() as connection, connection.begin():
            address = _parse(database_url).render_as_string(hide_password=True)
            _upgrade(connection, address)
    except OperationalError as error:
        raise HopError("database", reason_of(error)) from error
    finally:
        engine.dispose()


def alembic_config(connection: Connection) -> Config:
    """Alembic's settings made in code, so that a wheel needs no ini file."""
    config = Config()
    location = str(migrations_directory()).replace("%", "%%")
    config.set_main_option("script_location", location)
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    return config


def migrations_directory() -> Path:
    """Directory of the migrations: in an installed package, else in the checkout."""
    package = Path(iveg.__file__).parent
    installed = package / "_migrations"
    return installed if installed.is_dir() else package.parent / "migrations"


def revisions(connection: Connection) -> tuple[str | None, list[str]]:
    """The revision of a database, and all that this version knows, newest first."""
    revision = MigrationContext.configure(connection).get_current_revision()
    return revision, list(_known(migrations_directory()))


@cache
def _known(directory: Path) -> tuple[str, ...]:
    """All revisions, newest first; cached, as loading them is slow."""
    scripts = ScriptDirectory(str(directory))
    return tuple(script.revision for script in scripts.walk_revisions())


def reason_of(error: Exception) -> str:
    """Driver's error in one line, without statement and parameters."""
    return " ".join(str(getattr(error, "orig", None) or error).split())


def _upgrade(connection: Connection, where: str) -> None:
    if connection.dialect.name == "postgresql":
        lock = text("SELECT pg_advisory_xact_lock(:key)")
        connection.execute(lock, {"key": _ONE_AT_A_TIME})
    revision, known = revisions(connection)
    if revision == known[0]:
        return
    if revision is not None and revision not in known:
        raise DataFileError(
            where,
            "",
            f"its history was written by a newer iVeg (revision {revision}); start "
            "that version, or name another database in IVEG_DATABASE_URL",
        )
    try:
        command.upgrade(alembic_config(connection), "head")
    except (DatabaseError, CommandError) as error:
        raise DataFileError(
            where,
            "",
            f"a migration of its history cannot be finished ({reason_of(error)}); "
            "restore a backup, or name another database in IVEG_DATABASE_URL",
        ) from error


def _prepare_file(file: Path) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        damage = damage_of(file) if file.exists() else None
        if damage is not None:
            _move_aside(file, damage)
        # SQLite gives files beside the database its rights.
        make_private(file)
        for suffix in _BESIDE:
            neighbour = file.with_name(file.name + suffix)
            if neighbour.exists():
                make_private(neighbour)
    except OSError as error:
        raise HopError("database", f"{file}: {error.strerror}") from error


def damage_of(file: Path) -> str | None:
    """Damage of a file's structure; None where a check of 5 s finds none.

    A locked file is not damaged; later calls wait for it or fail.
    """
    deadline = clock.mono() + _CHECK_LIMIT_S
    with closing(sqlite3.connect(file, isolation_level=None)) as connection:
        connection.set_progress_handler(
            lambda: clock.mono() > deadline, _STEPS_BETWEEN_LOOKS
        )
        try:
            answer = connection.execute("PRAGMA quick_check(1)").fetchone()
        except sqlite3.OperationalError:
            return None
        except sqlite3.DatabaseError as error:
            return str(error)
    return None if answer == ("ok",) else str(answer[0])


def _move_aside(file: Path, damage: str) -> None:
    mark = f".corrupt-{datetime.fromtimestamp(clock.wall(), UTC):%Y%m%dT%H%M%S%f}"
    # Files beside it go along: SQLite would apply a journal to the new database.
    for part in ("", *_BESIDE):
        old = file.with_name(file.name + part)
        if old.exists():
            old.rename(file.with_name(file.name + mark + part))
    _log.error(
        "The history in %s is damaged (%s). It was moved aside as %s and a new one "
        "begins; earlier rows are missing until it is restored.",
        file,
        damage,
        file.name + mark,
    )
