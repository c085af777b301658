"""Whether the history's database can be used."""

from iveg.adapters.history.engine import revisions, sqlite_file
from iveg.adapters.history.queries import ask_once
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
    found, known = ask_once(database_url, revisions)
    newest = known[0]
    if found is not None and found not in known:
        raise HopError("database", f"a newer iVeg wrote it (migration {found})")
    if found != newest:
        raise HopError(
            "database",
            f"it is at migration {found or 'none'} and the newest is {newest}; "
            "`iveg db upgrade` mends that",
        )
