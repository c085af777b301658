"""Who is signed in, in a small file of JSON lines that is replaced as a whole.

Written beside the requests: a disk that is slow or full holds up neither a sign-in nor
a STOP, it only costs the memory of who was there.  No token is in the file, only its
SHA-256.
"""

import logging
import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Lock

import orjson

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Session:
    """Somebody who signed in.

    Attributes:
        digest: SHA-256 of the token (hex).
        role: What they were when they came.
        began: Unix time of the sign-in (s); ``seen`` of the last sign of life.
    """

    digest: str
    name: str
    role: str
    began: float
    seen: float


class FileSessions:
    """The sessions in one file, readable by its owner alone."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._writer: ThreadPoolExecutor | None = None
        self._newest: tuple[Session, ...] | None = None
        self._lock = Lock()
        self._failing = False

    def load(self) -> tuple[Session, ...]:
        """All that were kept; a line that cannot be read is nobody's session."""
        try:
            lines = self._path.read_bytes().splitlines()
        except FileNotFoundError:
            return ()
        except OSError as error:
            _log.warning("sessions are not remembered: %s", error)
            return ()
        read = [self._session(line, number) for number, line in enumerate(lines, 1)]
        return tuple(session for session in read if session is not None)

    def _session(self, line: bytes, number: int) -> Session | None:
        try:
            session = Session(**orjson.loads(line))
            whole = len(bytes.fromhex(session.digest)) == 32
            times = isinstance(session.began + session.seen, float)
            if whole and times and isinstance(session.name, str):
                return session
        except (ValueError, TypeError):
            pass
        _log.warning("%s, line %d: not readable, skipped", self._path, number)
        return None

    def keep(self, sessions: Iterable[Session]) -> None:
        """Have these on disk soon; returns at once.  What is newest wins."""
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
            self._replace(sessions)
        except OSError:
            # Told once, until it works again: every request may come here.
            if not self._failing:
                _log.exception("sessions could not be written")
            self._failing = True
        else:
            self._failing = False

    def _replace(self, sessions: Iterable[Session]) -> None:
        beside = self._path.with_suffix(".new")
        beside.unlink(missing_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        with os.fdopen(os.open(beside, flags, 0o600), "wb") as file:
            for session in sessions:
                file.write(orjson.dumps(asdict(session)) + b"\n")
            file.flush()
            os.fsync(file.fileno())
        beside.replace(self._path)
