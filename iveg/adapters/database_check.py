"""Whether the history's database can be used."""

from sqlalchemy.exc import DatabaseError

from iveg.adapters.history.engine import (
    reading_engine,
    reason_of,
    revisions,
    sqlite_file,
)
from iveg.domain.errors import HopError


def check_database(database_url: str) -> None:
    """Check that the history can be read and has the newest shape; change nothing.

    Raises:
        HopError: it is not there, cannot be read, or has another shape.
        SettingsError: the address cannot be used.
    """
    file = sqlite_file(database_url)
    if file is not None and not file.is_file():
        raise HopError(
            "database", f"there is none at {file}; `iveg db upgrade` makes it"
        )
    engine = reading_engine(database_url)
    try:
        with engine.connect() as connection:
            found, known = revisions(connection)
    except DatabaseError as error:
        raise HopError("database", reason_of(error)) from error
    finally:
        engine.dispose()
    newest = known[0]
    if found is not None and found not in known:
        raise HopError("database", f"a newer iVeg wrote it (migration {found})")
    if found != newest:
        raise HopError(
            "database",
            f"it is at migration {found or 'none'} and the newest is {newest}; "
            "`iveg db upgrade` mends that",
        )
