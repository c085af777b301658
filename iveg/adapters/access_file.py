"""File of accounts, tokens and sessions: written from memory, read at the start.

It holds JSON lines, one record each, and is replaced as a whole beside the requests: a
slow, full or missing disk holds up no sign-in and no STOP.  A file that another program
changed while iVeg ran is put aside and written anew from memory.  A file that was
damaged before the start is read line by line.  It holds no token, only its SHA-256.

``iveg user`` leaves each change in a file beside it, which the server takes up.
"""

import asyncio
import logging
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import orjson
from pydantic import TypeAdapter

from iveg.adapters.clock import new_id
from iveg.adapters.files import (
    Form,
    disk_errors,
    load_lines,
    put_aside,
    write_bytes,
    write_lines,
)
from iveg.domain.accounts import Access, AccessChange, Account, ApiToken, Session
from iveg.domain.audit import CONSOLE
from iveg.domain.records import Json

_log = logging.getLogger(__name__)


FORM: Final = Form("accounts")
_READ: Final[dict[str, TypeAdapter[Any]]] = {
    "account": TypeAdapter(Account),
    "token": TypeAdapter(ApiToken),
    "session": TypeAdapter(Session),
    "end": TypeAdapter(tuple[int, bool]),
    "change": TypeAdapter(AccessChange),
}
_MOST_ASIDE: Final = 5
_Seen = tuple[int, int, int]


class AccessFile:
    """The file and its writer.

    Attributes:
        aside: Names of damaged files that still lie in the folder.
        failing: Whether the last write failed.
        copied: Whether it has all records that an earlier version kept elsewhere.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.failing, self.copied = False, self.exists
        self.aside: list[str] = []
        self._writer = ThreadPoolExecutor(1, "accounts")
        self._newest = Access()
        self._is_queued = False
        self._seen: _Seen | None = None

    @property
    def exists(self) -> bool:
        """Whether the file exists, however damaged."""
        return self._path.exists()

    def beside(self, name: str) -> Path:
        """Another file of the same folder."""
        return self._path.with_name(name)

    # --- at the start -------------------------------------------------------------

    def load(self) -> Access:
        """All readable records; a damaged file is put aside."""
        self._look_aside()
        self._newest, is_whole = self.read()
        if self.exists and not is_whole:
            self._put_aside("differs from what iVeg wrote")
        return self._newest

    def read(self) -> tuple[Access, bool]:
        """All readable records, and whether the file is whole."""
        rows: dict[str, list[Any]] = {kind: [] for kind in _READ}
        try:
            head, *lines = self._path.read_bytes().splitlines()
        except (OSError, ValueError):
            head, lines = b"", []
        is_whole = head + b"\n" == FORM.line
        for number, line in enumerate(lines, 2):
            try:
                kind, row = _row(line)
                rows[kind].append(row)
            except ValueError:
                _log.warning("%s, line %d: not readable, skipped", self._path, number)
                is_whole = False
        # The last line counts the others: a file that was cut short has none.
        is_whole &= [count for count, _ in rows["end"]] == [len(lines) - 1]
        self.copied = self.exists and all(copied for _, copied in rows["end"])
        access = Access(
            tuple(rows["account"]), tuple(rows["token"]), tuple(rows["session"])
        )
        return access, is_whole

    # --- while iVeg runs ----------------------------------------------------------

    def save(self, access: Access) -> None:
        """Write to disk soon; returns at once.  The newest call wins."""
        self._newest = access
        if not self._is_queued:
            self._is_queued = True
            self._writer.submit(self._write)

    async def look(self) -> None:
        """Write the file anew where another program changed it, or a write failed."""
        await asyncio.wrap_future(self._writer.submit(self._look))

    def close(self) -> None:
        """Return when the newest state is on disk."""
        self._writer.shutdown()

    def _look(self) -> None:
        self._look_aside()
        if self.failing or self._is_foreign():
            self._write()

    def _look_aside(self) -> None:
        paths = self._path.parent.glob(f"{self._path.name}.damaged-*")
        self.aside = sorted(path.name for path in paths)

    def _write(self) -> None:
        # Cleared before the newest state is read: a later `save` queues another write.
        self._is_queued = False
        try:
            if self._is_foreign():
                self._put_aside("changed while iVeg ran")
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._seen = _seen(
                write_lines(self._path, FORM, _lines(self._newest, self.copied))
            )
            self.failing = False
        except OSError:
            # Logged once until the next success: every request may come here.
            if not self.failing:
                _log.exception("%s could not be written", self._path)
            self.failing = True

    def _put_aside(self, why: str) -> None:
        """Keep a damaged file under another name; the first five are kept."""
        self._seen = None
        if not self.exists or len(self.aside) >= _MOST_ASIDE:
            _log.error("%s: %s", self._path, why)
            return
        ending = f"damaged-{datetime.now(UTC):%Y%m%dT%H%M%S.%f}"
        try:
            # The file gets a second name: a crash before the next write loses nothing.
            os.link(self._path, f"{self._path}.{ending}")
            _log.error("%s: %s; a copy ends in %s", self._path, why, ending)
        except OSError:
            put_aside(self._path, why, ending)
        self._look_aside()

    def _is_foreign(self) -> bool:
        """Whether another program has changed or removed the file."""
        try:
            return self._seen not in (None, _seen(self._path.stat()))
        except OSError:
            return self._seen is not None

    # --- changes of the console ---------------------------------------------------

    @disk_errors()
    def leave(self, change: AccessChange) -> None:
        """Leave a change of the console for the server.

        Raises:
            HopError: the disk did not take it.
        """
        line = orjson.dumps({"change": change})
        write_bytes(self.beside(f"{self._path.name}.left-{new_id()}"), line)

    def left(self) -> list[tuple[Path, AccessChange]]:
        """Changes of the console that wait, oldest first."""
        changes = []
        for path in sorted(self._path.parent.glob(f"{self._path.name}.left-*")):
            if path.suffix.endswith((".new", ".unreadable")):
                continue
            try:
                _, change = _row(path.read_bytes())
                changes.append((path, replace(change, by=CONSOLE)))
            except (OSError, ValueError, TypeError) as error:
                put_aside(path, type(error).__name__)
        return changes

    async def drop(self, left: list[Path]) -> None:
        """Delete changes that were taken up, after the writes before are on disk."""
        for path in left:
            deletion = self._writer.submit(path.unlink, missing_ok=True)
            await asyncio.wrap_future(deletion)


def _seen(status: os.stat_result) -> _Seen:
    """Inode, size (bytes) and time of change, which tell a foreign change."""
    return status.st_ino, status.st_size, status.st_mtime_ns


_EARLIER_METHODS: Final = {"passkey": "password", "pin": "link", "tablet": "link"}


def earlier_sessions(path: Path) -> tuple[Session, ...]:
    """Sessions of earlier versions, which kept them in a file of their own."""
    fields = TypeAdapter(dict[str, Any])

    def read(line: bytes) -> Session:
        entry = fields.validate_json(line)
        method = entry.get("method", "link")
        known = entry | {"method": _EARLIER_METHODS.get(str(method), method)}
        session: Session = _READ["session"].validate_python(known)
        return session

    return tuple(load_lines(path, Form("sessions"), read))


def _lines(access: Access, copied: bool) -> list[Json]:
    rows: list[Json] = [
        *({"account": row} for row in access.accounts),
        *({"token": row} for row in access.tokens),
        *({"session": row} for row in access.sessions),
    ]
    return [*rows, {"end": (len(rows), copied)}]


def _row(line: bytes) -> tuple[str, Any]:
    """Kind and row of a line; the checksum of earlier versions is ignored.

    Raises:
        ValueError: it is no record.
    """
    entry = orjson.loads(line)
    kind = next(iter(entry), "") if isinstance(entry, dict) else ""
    if kind not in _READ:
        raise ValueError("no record")
    return kind, _READ[kind].validate_json(orjson.dumps(entry[kind]), strict=True)
