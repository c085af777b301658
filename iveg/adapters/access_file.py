"""File of accounts, tokens and sessions, which memory writes and a start reads.

JSON lines, a record and its checksum in each, replaced as a whole beside the requests:
a disk that is slow, full or gone holds up no sign-in and no STOP.  What somebody else
did to the file while iVeg ran is put aside and written anew from memory; of a file that
was damaged before the start every whole line is read.  No token is in it, only SHA-256.

``iveg user`` leaves each change in a file beside it, and the server takes that up.
"""

import asyncio
import contextlib
import logging
import os
import zlib
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from typing import Any, Final

import orjson
from pydantic import TypeAdapter

from iveg.adapters.clock import new_id
from iveg.adapters.files import Form, put_aside, read_lines, write_bytes, write_lines
from iveg.domain.accounts import Access, AccessChange, Account, ApiToken, Session
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import DataFileError
from iveg.domain.records import Json

_log = logging.getLogger(__name__)

FORM: Final = Form("accounts")
_READ: Final[dict[str, TypeAdapter[Any]]] = {
    "account": TypeAdapter(Account),
    "token": TypeAdapter(ApiToken),
    "session": TypeAdapter(Session),
    "end": TypeAdapter(tuple[int, bool]),
    "change": TypeAdapter(dict[str, Any]),
}
_EARLIER: Final = {"passkey": "password", "pin": "link", "tablet": "link"}
_MOST_ASIDE: Final = 5
_Seen = tuple[int, int, int]


class AccessFile:
    """The file, its writer, and what became of it.

    Attributes:
        damaged: How often it was found as nobody here had written it.
        aside: Names of damaged files that nobody has taken away yet.
        failing: Why it cannot be written; empty: it can.
        copied: Whether all that an earlier version had kept elsewhere is in it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.damaged, self.failing = 0, ""
        self.aside: list[str] = []
        self.copied = self.exists
        self._writer = ThreadPoolExecutor(1, "accounts")
        self._newest: Access | None = None
        self._written = Access()
        self._lock = Lock()
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
        """All that can be read; a damaged file is put aside and written anew."""
        self._look_aside()
        if not self.exists:
            return Access()
        rows, is_whole = self.read()
        if not is_whole:
            self._put_aside("not as it was written")
            self._write(rows)
        return rows

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
                kind, row = _checked(line)
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
        with self._lock:
            is_writing = self._newest is not None
            self._newest = access
        if not is_writing:
            self._writer.submit(self._write_newest)

    async def look(self) -> None:
        """Write the file anew where it is not as it was written, or was not."""
        await asyncio.wrap_future(self._writer.submit(self._look))

    def close(self) -> None:
        """Return when the newest is on disk."""
        self._writer.shutdown()

    def _look_aside(self) -> None:
        found = self._path.parent.glob(f"{self._path.name}.damaged-*")
        self.aside = sorted(one.name for one in found)

    def _look(self) -> None:
        self._look_aside()
        if self.failing or self._is_foreign():
            self._write(self._written)

    def _write_newest(self) -> None:
        with self._lock:
            newest, self._newest = self._newest, None
        if newest is not None:
            self._write(newest)

    def _write(self, access: Access) -> None:
        self._written = access
        try:
            if self._is_foreign():
                self._put_aside("changed while iVeg ran")
            self._path.parent.mkdir(parents=True, exist_ok=True)
            lines = _lines(access, copied=self.copied)
            self._seen = _seen(write_lines(self._path, FORM, lines))
        except OSError as error:
            # Told once, until it works again: every request may come here.
            if not self.failing:
                _log.exception("%s could not be written", self._path)
            self.failing = str(error)
        else:
            self.failing = ""

    def _put_aside(self, why: str) -> None:
        self.damaged += 1
        for oldest in self.aside[: 1 - _MOST_ASIDE]:
            with contextlib.suppress(OSError):
                self._path.with_name(oldest).unlink()
        self._seen = self._stat()
        if self._seen is None:
            _log.error("%s: gone while iVeg ran", self._path)
            return
        ending = f"damaged-{datetime.now(UTC):%Y%m%dT%H%M%S.%f}"
        aside = self._path.with_name(f"{self._path.name}.{ending}")
        try:
            # A name more, so that a crash before the next writing loses nothing.
            os.link(self._path, aside)
            _log.error("%s: %s; a copy is %s", self._path, why, aside.name)
        except OSError:
            put_aside(self._path, why, ending)
            self._seen = None
        self._look_aside()

    def _is_foreign(self) -> bool:
        return self._seen is not None and self._stat() != self._seen

    def _stat(self) -> _Seen | None:
        try:
            return _seen(self._path.stat())
        except OSError:
            return None

    # --- changes of the console ---------------------------------------------------

    def leave(self, change: AccessChange) -> None:
        """Leave a change of the console for the server.

        Raises:
            OSError: the disk did not take it.
        """
        kind = "token" if isinstance(change.row, ApiToken) else "account"
        told = {
            "action": change.action,
            "kind": kind,
            "row": change.row,
            "details": change.details,
            "gone": change.gone,
        }
        line = orjson.dumps(_with_checksum("change", told))
        write_bytes(self._path.with_name(f"{self._path.name}.left-{new_id()}"), line)

    def left(self) -> list[tuple[Path, AccessChange]]:
        """Changes of the console that wait, the oldest first."""
        found = []
        for path in sorted(self._path.parent.glob(f"{self._path.name}.left-*")):
            if path.suffix.endswith((".new", ".unreadable")):
                continue
            try:
                _, told = _checked(path.read_bytes())
                kept = orjson.dumps(told.pop("row"))
                row = _READ[told.pop("kind")].validate_json(kept, strict=True)
                found.append((path, AccessChange(CONSOLE, row=row, **told)))
            except (OSError, ValueError, KeyError, TypeError) as error:
                put_aside(path, type(error).__name__)
        return found

    async def taken(self, changes: list[Path]) -> bool:
        """Delete changes that count, once the file has them; whether it has."""
        return await asyncio.wrap_future(self._writer.submit(self._take, changes))

    def _take(self, changes: list[Path]) -> bool:
        if self.failing:
            return False
        for path in changes:
            with contextlib.suppress(OSError):
                path.unlink()
        return True


def _seen(found: os.stat_result) -> _Seen:
    return found.st_ino, found.st_size, found.st_mtime_ns


def earlier_sessions(path: Path) -> tuple[Session, ...]:
    """Sessions of earlier versions, which had a file of their own."""
    found = []
    try:
        for _, line in read_lines(path, Form("sessions")):
            with contextlib.suppress(ValueError, AttributeError):
                entry = orjson.loads(line)
                method = _EARLIER.get(entry.get("method"), entry.get("method", "link"))
                told = orjson.dumps(entry | {"method": method})
                found.append(_READ["session"].validate_json(told, strict=True))
    except (OSError, DataFileError) as error:
        _log.warning("sessions are not remembered: %s", error)
    return tuple(found)


def _lines(access: Access, copied: bool) -> list[Json]:
    rows: list[tuple[str, object]] = [
        *(("account", one) for one in access.accounts),
        *(("token", one) for one in access.tokens),
        *(("session", one) for one in access.sessions),
    ]
    return [_with_checksum(*one) for one in (*rows, ("end", (len(rows), copied)))]


def _with_checksum(kind: str, row: object) -> Json:
    written = orjson.dumps(row)
    return {kind: orjson.Fragment(written), "crc": zlib.crc32(written)}


def _checked(line: bytes) -> tuple[str, Any]:
    """Kind and row of a line. Raises ValueError: it is not as it was written."""
    entry = orjson.loads(line)
    if not isinstance(entry, dict) or len(entry) != 2 or "crc" not in entry:
        raise ValueError("no record")
    kind = next(iter(entry))
    written = orjson.dumps(entry[kind])
    if kind not in _READ or zlib.crc32(written) != entry["crc"]:
        raise ValueError("another checksum")
    row = _READ[kind].validate_json(written, strict=True)
    if isinstance(row, Session):
        bytes.fromhex(row.digest)
    return kind, row
