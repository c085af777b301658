"""A history of the newest shape that is made once in a process, and copied for a test.

All migrations take a fifth of a second of processor time, most tests have a database of
their own, and the migrations have tests of their own.
"""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from iveg.adapters.history.engine import sqlite_file
from iveg.adapters.history.migrate import upgrade


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
