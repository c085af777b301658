"""File of accounts, tokens and sessions, which memory writes and a start reads.

JSON lines, a record in each, replaced as a whole beside the requests: a disk that is
slow, full or gone holds up no sign-in and no STOP.  A file that another
program changed while iVeg ran is put aside and written anew from memory; of a file that
was damaged before the start every whole line is read.  No token is in it, only SHA-256.

``iveg user`` leaves each change in a file beside it, and the server takes that up.
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
from iveg.adapters.files import Form, load_lines, put_aside, write_bytes, write_lines
from iveg.domain.accounts import Access, AccessChange, Account, ApiToken, Session
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import HopError
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
        aside: Names of damaged files that nobody has taken away yet.
        failing: Whether the disk refused it at the last time.
        copied: Whether all that an earlier version had kept elsewhere is in it.
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
        """Whether there is one, however damaged."""
        return self._path.exists()

    def beside(self, name: str) -> Path:
        """Another file of the same folder."""
        return self._path.with_name(name)

    # --- at the start -------------------------------------------------------------

    def load(self) -> Access:
        """All that can be read; a damaged file is put aside."""
        self._look_aside()
        self._newest, is_whole = self.read()
        if self.exists and not is_whole:
            self._put_aside("not as it was written")
        return self._newest

    def read(self) -> tuple[Access, bool]:
        """All that can be read, and whether that is all that was written."""
        found: dict[str, list[Any]] = {kind: [] for kind in _READ}
        try:
            head, *lines = self._path.read_bytes().splitlines()
        except (OSError, ValueError):
            head, lines = b"", []
        is_whole = head + b"\n" == FORM.line
        for number, line in enumerate(lines, 2):
            try:
                kind, row = _row(line)
                found[kind].append(row)
            except ValueError:
                _log.warning("%s, line %d: not readable", self._path, number)
                is_whole = False
        is_whole &= [count for count, _ in found["end"]] == [len(lines) - 1]
        self.copied = self.exists and all(copied for _, copied in found["end"])
        access = Access(
            tuple(found["account"]), tuple(found["token"]), tuple(found["session"])
        )
        return access, is_whole

    # --- while iVeg runs ----------------------------------------------------------

    def save(self, access: Access) -> None:
        """Write this to disk soon; returns at once. The newest call wins."""
        self._newest = access
        if not self._is_queued:
            self._is_queued = True
            self._writer.submit(self._write)

    async def look(self) -> None:
        """Write the file anew where it is not as it was written, or was not."""
        await asyncio.wrap_future(self._writer.submit(self._look))

    def close(self) -> None:
        """Return when the newest is on disk."""
        self._writer.shutdown()

    def _look(self) -> None:
        self._look_aside()
        if self.failing or self._is_foreign():
            self._write()

    def _look_aside(self) -> None:
        found = self._path.parent.glob(f"{self._path.name}.damaged-*")
        self.aside = sorted(path.name for path in found)

    def _write(self) -> None:
        # Before the newest is read: what is saved from here on queues the next writing.
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
            # Told once, until it works again: every request may come here.
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
            # A name more, so that a crash before the next writing loses nothing.
            os.link(self._path, f"{self._path}.{ending}")
            _log.error("%s: %s; a copy ends in %s", self._path, why, ending)
        except OSError:
            put_aside(self._path, why, ending)
        self._look_aside()

    def _is_foreign(self) -> bool:
        """Whether another program has changed or taken away the file."""
        try:
            return self._seen not in (None, _seen(self._path.stat()))
        except OSError:
            return self._seen is not None

    # --- changes of the console ---------------------------------------------------

    def leave(self, change: AccessChange) -> None:
        """Leave a change of the console for the server.

        Raises:
            HopError: the disk did not take it.
        """
        line = orjson.dumps({"change": change})
        try:
            write_bytes(self.beside(f"{self._path.name}.left-{new_id()}"), line)
        except OSError as error:
            raise HopError("disk", str(error)) from error

    def left(self) -> list[tuple[Path, AccessChange]]:
        """Changes of the console that wait, the oldest first."""
        found = []
        for path in sorted(self._path.parent.glob(f"{self._path.name}.left-*")):
            if path.suffix.endswith((".new", ".unreadable")):
                continue
            try:
                _, change = _row(path.read_bytes())
                found.append((path, replace(change, by=CONSOLE)))
            except (OSError, ValueError, TypeError) as error:
                put_aside(path, type(error).__name__)
        return found

    async def drop(self, left: list[Path]) -> None:
        """Delete changes that count, after what is on its way to disk is there."""
        await asyncio.wrap_future(self._writer.submit(_unlink, left))


def _unlink(files: list[Path]) -> None:
    for path in files:
        path.unlink(missing_ok=True)


def _seen(found: os.stat_result) -> _Seen:
    return found.st_ino, found.st_size, found.st_mtime_ns


_EARLIER_METHODS: Final = {"passkey": "password", "pin": "link", "tablet": "link"}


def earlier_sessions(path: Path) -> tuple[Session, ...]:
    """Sessions of earlier versions, which had a file of their own."""
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
    """Kind and row of a line; the checksum of earlier versions is left out.

    Raises:
        ValueError: it is no record.
    """
    entry = orjson.loads(line)
    kind = next(iter(entry), "") if isinstance(entry, dict) else ""
    if kind not in _READ:
        raise ValueError("no record")
    row = _READ[kind].validate_json(orjson.dumps(entry[kind]), strict=True)
    if isinstance(row, Session):
        bytes.fromhex(row.digest)  # nobody finds a session by another digest
    return kind, row
