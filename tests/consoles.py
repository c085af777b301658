"""``iveg user`` without a process of its own."""

from pathlib import Path

from iveg.adapters import clock
from iveg.adapters.access_file import AccessFile
from iveg.adapters.admission import Admission
from iveg.domain.accounts import AccessBook
from iveg.domain.audit import CONSOLE


def console(folder: Path) -> Admission:
    """Leaves what it changes for the server whose files are in this folder."""
    book = AccessBook()
    book.on_change.append(AccessFile(folder / "accounts.jsonl").leave)
    return Admission(book, CONSOLE, clock.wall())
