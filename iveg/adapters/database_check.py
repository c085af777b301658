"""Check of the history's database."""

from iveg.adapters.history.engine import revisions, sqlite_file
from iveg.adapters.history.queries import ask_once
from iveg.domain.errors import HopError


def check_database(database_url: str) -> None:
    """Check that the history can be read and has the newest schema; change nothing.

    Raises:
        HopError: it is missing, cannot be read, or has another schema.
        SettingsError: the address cannot be used.
    """
    file = sqlite_file(database_url)
    if file is not None and not file.is_file():
        raise HopError(
            "database", f"there is none at {file}; `iveg db upgrade` makes it"
        )
    revision, known = ask_once(database_url, revisions)
    if revision is not None and revision not in known:
        raise HopError("database", f"a newer iVeg wrote it (migration {revision})")
    if revision != known[0]:
        raise HopError(
            "database",
            f"it is at migration {revision or 'none'} and the newest is {known[0]}; "
            "`iveg db upgrade` mends that",
        )
