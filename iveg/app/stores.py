"""Storage that outlives a restart: the history and the files beside it."""

from dataclasses import dataclass
from pathlib import Path

from iveg.adapters.contacts import FileContacts
from iveg.adapters.detectors import FileDetectors
from iveg.adapters.history.engine import history_url, sqlite_file
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder, journal_file
from iveg.adapters.journal import FileJournal
from iveg.adapters.rules import FileRules
from iveg.adapters.sessions import FileSessions
from iveg.settings import Settings


@dataclass(frozen=True, slots=True)
class Stores:
    """Everything that iVeg keeps.

    Attributes:
        directory: Where the files are: beside the database where that is a file.
    """

    directory: Path
    recorder: Recorder
    queries: Queries
    journal: FileJournal
    rules: FileRules
    contacts: FileContacts
    detectors: FileDetectors
    sessions: FileSessions

    async def close(self) -> None:
        """Write down what waits, and let go of files and database."""
        await self.recorder.close()
        self.queries.close()
        self.journal.close()
        self.sessions.close()


def open_stores(settings: Settings, data_directory: Path) -> Stores:
    """Open them; the directory is made where it is missing."""
    url = history_url(settings.database_url, data_directory)
    database = sqlite_file(url)
    directory = data_directory if database is None else database.parent
    directory.mkdir(parents=True, exist_ok=True)
    return Stores(
        directory,
        Recorder(url, journal_file(url, directory)),
        Queries(url),
        FileJournal(directory / "commands.jsonl"),
        FileRules(directory / "rules.jsonl"),
        FileContacts(directory / "contacts.jsonl"),
        FileDetectors(directory / "detectors.jsonl"),
        FileSessions(directory / "sessions.jsonl"),
    )
