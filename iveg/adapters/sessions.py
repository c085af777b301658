"""Sessions, in a small file of JSON lines that is replaced as a whole.

Written beside the requests: a slow or full disk holds up neither a sign-in nor a STOP,
it only costs sessions after a restart.  The file holds no token, only its SHA-256.
"""

import hashlib
import logging
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Lock
from typing import Annotated

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from iveg.adapters.files import Form, read_lines, write_lines
from iveg.domain.accounts import SignInMethod
from iveg.domain.errors import DataFileError

_log = logging.getLogger(__name__)

FORM = Form("sessions")
_UnixTime = Annotated[float, Field(allow_inf_nan=False)]


@dataclass(frozen=True, slots=True)
class Session:
    """A signed-in person.

    Attributes:
        digest: SHA-256 of the token (hex).
        role: What they were when they came.
        began: Unix time of the sign-in (s); ``seen`` of the last sign of life.
        person: Id of the account; empty in sessions of earlier versions.
        method: How they signed in.
        proven: When the person proved who they are (Unix s); None: not told.
        until: When it is over at the latest (Unix s); None: no earlier than others.
        wall: It was left to a screen that everybody passes.
        holder: Id of the account that unlocked a tablet; empty: it is locked.
        acted: When that person last did something (Unix s).
    """

    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    name: str
    role: str
    began: _UnixTime
    seen: _UnixTime
    person: str = ""
    method: SignInMethod = "link"
    proven: _UnixTime | None = None
    until: _UnixTime | None = None
    wall: bool = False
    holder: str = ""
    acted: _UnixTime = 0.0

    @property
    def session_id(self) -> str:
        """Names it to people; tells nobody the digest, and lets nobody in."""
        return hashlib.sha256(f"id:{self.digest}".encode()).hexdigest()[:16]

    __pydantic_config__ = ConfigDict(strict=True, extra="forbid")


_STORED = TypeAdapter(Session)


class FileSessions:
    """The sessions in one file, readable by its owner alone."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._writer: ThreadPoolExecutor | None = None
        self._newest: tuple[Session, ...] | None = None
        self._lock = Lock()
        self._failing = False

    def load(self) -> tuple[Session, ...]:
        """All stored sessions; an unreadable line is skipped."""
        sessions = []
        try:
            for number, line in read_lines(self._path, FORM):
                try:
                    sessions.append(_STORED.validate_json(line))
                except ValidationError:
                    _log.warning(
                        "%s, line %d: not readable, skipped", self._path, number
                    )
        except (OSError, DataFileError) as error:
            _log.warning("sessions are not remembered: %s", error)
        return tuple(sessions)

    def save(self, sessions: Iterable[Session]) -> None:
        """Write these to disk soon; returns at once. The newest call wins."""
        with self._lock:
            is_writing = self._newest is not None
            self._newest = tuple(sessions)
        if self._writer is None:
            self._writer = ThreadPoolExecutor(1, "sessions")
        if not is_writing:
            self._writer.submit(self._write)

    def close(self) -> None:
        """Return when the newest is on disk."""
        if self._writer is not None:
            self._writer.shutdown()
            self._writer = None

    def _write(self) -> None:
        with self._lock:
            sessions, self._newest = self._newest or (), None
        try:
            write_lines(self._path, FORM, map(asdict, sessions))
        except OSError:
            # Told once, until it works again: every request may come here.
            if not self._failing:
                _log.exception("sessions could not be written")
            self._failing = True
        else:
            self._failing = False
