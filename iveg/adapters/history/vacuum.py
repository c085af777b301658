"""Room of deleted rows, given back to the disk."""

import sqlite3
from collections.abc import Callable
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from iveg.adapters.disk import disk_space
from iveg.adapters.history.engine import sqlite_file, writing_engine
from iveg.adapters.history.migrate import reason_of
from iveg.domain.disk_space import DiskSpace
from iveg.domain.errors import HopError

_IN_USE = (
    "another program has it open; end iveg serve first, or leave it: new rows fill "
    "the room of deleted ones"
)


def vacuum(
    database_url: str, read_space: Callable[[Path], DiskSpace] = disk_space
) -> None:
    """Give the room of deleted rows back.

    An SQLite file is written anew, by nobody else meanwhile; PostgreSQL does it beside
    a running iVeg.

    Args:
        database_url: Of the history.
        read_space: Room on the disk of a directory.

    Raises:
        HopError: it cannot be done now, with the reason.
        SettingsError: the address cannot be used.
    """
    file = sqlite_file(database_url)
    try:
        if file is None:
            _vacuum_server(database_url)
        else:
            _vacuum_file(file, read_space(file.parent))
    except (DBAPIError, sqlite3.Error) as error:
        raise HopError("database", reason_of(error)) from error


def _vacuum_file(file: Path, space: DiskSpace) -> None:
    needed = file.stat().st_size
    if space.free < needed:
        reason = f"{needed // 10**6} MB are needed beside it while it is written anew"
        raise HopError("database", reason)
    connection = sqlite3.connect(file, timeout=0.5, isolation_level=None)
    try:
        # Before its first read: so it is refused while anybody has the file open.
        connection.execute("PRAGMA locking_mode=EXCLUSIVE")
        connection.execute("BEGIN EXCLUSIVE")
        connection.execute("COMMIT")
        connection.execute("PRAGMA auto_vacuum=INCREMENTAL")
        connection.execute("VACUUM")
    except sqlite3.OperationalError as error:
        if "locked" in str(error):
            raise HopError("database", _IN_USE) from error
        raise
    finally:
        connection.close()


def _vacuum_server(database_url: str) -> None:
    engine = writing_engine(database_url)
    try:
        with engine.connect() as connection:
            alone = connection.execution_options(isolation_level="AUTOCOMMIT")
            alone.exec_driver_sql("VACUUM (ANALYZE)")
    finally:
        engine.dispose()
