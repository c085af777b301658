"""iVeg's own files: JSON lines that are on the disk whole, or not at all.

Each file begins with a line that names its content and version; a file without that
line is of version 0.  A file of a newer iVeg is refused.
"""

import asyncio
import contextlib
import logging
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TypeVar

import orjson
from pydantic import ValidationError

from iveg.domain.errors import DataFileError, HopError

_log = logging.getLogger(__name__)

_OWNER_ALONE = 0o600
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Form:
    """Content and version of a file: its first line."""

    name: str
    version: int = 1

    @property
    def line(self) -> bytes:
        """As it stands in the file."""
        return orjson.dumps({"iveg": self.name, "version": self.version}) + b"\n"


def write_lines(path: Path, form: Form, values: Iterable[object]) -> None:
    """Replace a file; a reader finds the old or the new one, never a part.

    Raises:
        OSError: the disk did not take it; the old file stands.
    """
    lines = (orjson.dumps(value) + b"\n" for value in values)
    write_bytes(path, form.line + b"".join(lines))


async def save_lines(path: Path, form: Form, values: Iterable[object]) -> None:
    """The same in a thread; returns when it is on disk.

    Raises:
        HopError: the disk did not take it; the old file stands.
    """
    try:
        await asyncio.to_thread(write_lines, path, form, values)
    except OSError as error:
        raise HopError("disk", str(error)) from error


def write_bytes(path: Path, content: bytes) -> None:
    """The same of any content: written beside, synced, then moved.

    Raises:
        OSError: the disk did not take it; the old file stands.
    """
    beside = path.with_name(path.name + ".new")
    beside.unlink(missing_ok=True)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    with os.fdopen(os.open(beside, flags, _OWNER_ALONE), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)
    directory = os.open(path.parent, os.O_RDONLY)
    try:
        # Else the move itself may be lost with the power.
        os.fsync(directory)
    finally:
        os.close(directory)


def read_lines(path: Path, form: Form) -> Iterator[tuple[int, bytes]]:
    """Every line but the first and empty ones, with its number; none without a file.

    Raises:
        DataFileError: it is something else, or a newer iVeg wrote it.
        OSError: it cannot be read.
    """
    try:
        lines = path.read_bytes().splitlines()
    except FileNotFoundError:
        return
    for number, line in enumerate(lines, 1):
        if number == 1 and _is_head(path, form, line):
            continue
        if line:
            yield number, line


def load_lines(path: Path, form: Form, read: Callable[[bytes], _T]) -> list[_T]:
    """The values of a file; one with a line that cannot be read is put aside whole."""
    try:
        return [read(line) for _, line in read_lines(path, form)]
    except (ValidationError, DataFileError, OSError) as error:
        put_aside(path, type(error).__name__)
        return []


def _is_head(path: Path, form: Form, line: bytes) -> bool:
    """Whether the first line says what the file is."""
    try:
        head = orjson.loads(line)
    except orjson.JSONDecodeError:
        return False
    if not isinstance(head, dict) or "iveg" not in head:
        return False
    name, version = head["iveg"], head.get("version")
    if name != form.name or not isinstance(version, int) or version > form.version:
        reason = (
            f"it holds {name} {version}; this iVeg reads {form.name} {form.version}"
        )
        raise DataFileError(str(path), "line 1", reason)
    return True


def put_aside(path: Path, why: str, ending: str = "unreadable") -> bool:
    """Rename a damaged file, so that it can be looked at; whether that was possible."""
    aside = path.with_name(f"{path.name}.{ending}")
    try:
        path.replace(aside)
    except OSError as error:
        _log.error("%s: %s; it stays as it is: %s", path, why, error)
        return False
    _log.error("%s: %s; it is put aside as %s", path, why, aside.name)
    return True


def make_private(path: Path) -> None:
    """Let nobody else read a file, which is made where it is missing.

    One that is there is not opened: closing it would drop SQLite's locks on it.

    Raises:
        OSError: it cannot be made.
    """
    try:
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _OWNER_ALONE))
    except FileExistsError:
        # It may belong to somebody else, who chose who reads it.
        with contextlib.suppress(PermissionError):
            path.chmod(_OWNER_ALONE)


class AppendedFile:
    """A file that grows by lines, each on the disk before ``append`` returns."""

    def __init__(self, path: Path, form: Form) -> None:
        self._path = path
        self._form = form
        self._file: IO[bytes] | None = None
        self._is_torn = False
        """The last line may be half written: the next one must not be glued to it."""

    def append(self, value: object) -> None:
        """Append one line.

        Raises:
            OSError: the disk did not take it.
        """
        line = orjson.dumps(value) + b"\n"
        file = self._file or self._open()
        if self._is_torn:
            line = b"\n" + line
        self._is_torn = True
        written = file.write(line)
        os.fsync(file.fileno())
        if written != len(line):
            raise OSError(f"{written} of {len(line)} bytes written")
        self._is_torn = False

    def _open(self) -> IO[bytes]:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        if not self._path.exists():
            write_bytes(self._path, self._form.line)
        self._file = self._path.open("a+b", buffering=0)
        self._is_torn = not _ends_a_line(self._file)
        return self._file

    def close(self) -> None:
        """Let the file go; the next line opens it again."""
        if self._file is not None:
            self._file.close()
            self._file = None


def _ends_a_line(file: IO[bytes]) -> bool:
    if file.seek(0, os.SEEK_END) == 0:
        return True
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"
