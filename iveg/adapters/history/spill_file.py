"""Spill file of the history: rows that may not be lost, beside the database.

One JSON line a record, on the disk before ``append`` returns.  Ten megabytes are held
in reserve: a full disk stops the history long before it stops the journal.
"""

import errno
import logging
import os
import threading
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import orjson

from iveg.adapters.files import make_private
from iveg.domain.errors import HopError
from iveg.domain.records import RECORD_TYPES, Record
from iveg.domain.transports import DIRECT, FIWARE
from iveg.pipeline.record import Waiting

_log = logging.getLogger(__name__)
_KINDS: dict[str, type[Record]] = {kind.__name__: kind for kind in RECORD_TYPES}
_ONCE_TEXT = frozenset({"rule_parameters", "links", "slots", "members", "box"})
"""Fields that the version before wrote as JSON in a text."""
_ONCE_NAMED = {"road": "transport", "mandated_factor": "limit_factor"}
"""Fields that the version before called by another name."""
_ONCE_VALUED = {"mqtt": DIRECT.id, "orion": FIWARE.id}
"""Transports in the words of the version before."""
_RESERVE_BYTES = 10 * 2**20
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT)


class SpillFile:
    """An append-only file; safe to use from several threads.

    Args:
        reserve_bytes: Given back to the disk when it is full.

    Attributes:
        unreadable: Lines that could not be read back, such as one torn by a power cut.
    """

    def __init__(
        self,
        file: Path,
        reserve_bytes: int = _RESERVE_BYTES,
    ) -> None:
        self._file = file
        self._reserve = file.with_name(file.name + "-reserve")
        self._reserve_bytes = reserve_bytes
        self._lock = threading.Lock()
        self.unreadable = 0

    @property
    def size(self) -> int:
        """Bytes that wait to be replayed."""
        return self._file.stat().st_size if self._file.exists() else 0

    def append(self, rows: Sequence[Waiting]) -> None:
        """Put rows on the disk.

        Raises:
            HopError: the disk did not take them; nothing of them counts.
        """
        lines = b"".join(_write_line(row) for row in rows)
        with self._lock:
            try:
                self._append(lines)
            except OSError as error:
                raise HopError("journal", error.strerror or str(error)) from error

    def read(self, start: int, most: int) -> tuple[list[Waiting], int]:
        """Up to ``most`` lines from a position, and the position after them.

        Raises:
            HopError: the file cannot be read.
        """
        with self._lock:
            try:
                return self._read(start, most)
            except OSError as error:
                raise HopError("journal", error.strerror or str(error)) from error

    def clear(self, end: int) -> bool:
        """Empty the file if nothing came after ``end``; whether it is empty now.

        Raises:
            HopError: the file cannot be written.
        """
        with self._lock:
            try:
                if self.size != end:
                    return False
                os.truncate(self._file, 0)
                self._keep_reserve()
            except OSError as error:
                raise HopError("journal", error.strerror or str(error)) from error
        return True

    def keep_reserve(self) -> None:
        """Take the reserve from the disk while there is room."""
        with self._lock:
            self._keep_reserve()

    def _append(self, lines: bytes) -> None:
        end = self.size
        try:
            self._put(lines)
        except OSError as error:
            if error.errno not in _NO_ROOM or not self._reserve.exists():
                self._cut(end)
                raise
            self._reserve.unlink()
            self._cut(end)
            self._put(lines)

    def _put(self, lines: bytes) -> None:
        self._file.parent.mkdir(parents=True, exist_ok=True)
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND
        descriptor = os.open(self._file, flags, 0o600)
        try:
            rest = memoryview(lines)
            while rest:
                rest = rest[self.write(descriptor, rest) :]
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def write(self, descriptor: int, data: memoryview) -> int:
        """Put bytes on the disk; returns how many it took.

        Raises:
            OSError: it takes none.
        """
        return os.write(descriptor, data)

    def _cut(self, end: int) -> None:
        # Half a line must not run into the next one.
        if self.size > end:
            os.truncate(self._file, end)

    def _read(self, start: int, most: int) -> tuple[list[Waiting], int]:
        rows: list[Waiting] = []
        if not self._file.exists():
            return rows, 0
        with self._file.open("rb") as file:
            file.seek(start)
            for line in file:
                row = _read_line(line)
                if row is None:
                    self.unreadable += 1
                    _log.error("history: a line of %s is unreadable", self._file.name)
                else:
                    rows.append(row)
                start += len(line)
                if len(rows) >= most:
                    break
        return rows, start

    def _keep_reserve(self) -> None:
        if self._reserve.exists():
            return
        try:
            self._reserve.parent.mkdir(parents=True, exist_ok=True)
            make_private(self._reserve)
            with self._reserve.open("wb") as file:
                # Zeros are written out: a hole in a sparse file reserves nothing.
                file.write(bytes(self._reserve_bytes))
                os.fsync(file.fileno())
        except OSError:
            self._reserve.unlink(missing_ok=True)


def _write_line(row: Waiting) -> bytes:
    head = {"kind": type(row.record).__name__, "revision": row.revision}
    try:
        return orjson.dumps(
            head | {"record": asdict(row.record)}, option=orjson.OPT_APPEND_NEWLINE
        )
    except orjson.JSONEncodeError as error:
        _log.error("history: a %s cannot be written: %s", head["kind"], error)
        return b""


def _read_line(line: bytes) -> Waiting | None:
    try:
        value = orjson.loads(line)
        record = _KINDS[value["kind"]](**_as_now(value["record"]))
        return Waiting(record, int(value["revision"]), 0.0)
    except (ValueError, TypeError, KeyError):
        return None


def _as_now(members: dict[str, Any]) -> dict[str, Any]:
    """A record as this version has it, of a line that the version before wrote."""
    for name in _ONCE_TEXT & members.keys():
        if isinstance(members[name], str):
            members[name] = orjson.loads(members[name])
    for before in _ONCE_NAMED.keys() & members.keys():
        value = members.pop(before)
        members[_ONCE_NAMED[before]] = _ONCE_VALUED.get(value, value)
    for what in ("sent", "answer"):
        for transport in ("direct", "fiware"):
            at = members.pop(f"{what}_{transport}_at", None)
            if at is not None:
                members.setdefault(f"{what}_at", {})[transport] = at
    return members
