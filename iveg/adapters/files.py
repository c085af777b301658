"""iVeg's own files, which are on the disk whole or not at all; locks, room, priority.

A file of JSON lines begins with a line that names its content and version; a file
without that line is of version 0.  One of a newer iVeg is refused, and one that cannot
be read is put aside.
"""

import asyncio
import contextlib
import fcntl
import logging
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import orjson
from pydantic import TypeAdapter, ValidationError

from iveg.domain.errors import DataFileError, HopError
from iveg.domain.retention import DiskSpace


def disk_space(directory: Path) -> DiskSpace:
    """Room on the disk of a directory.

    Raises:
        OSError: it cannot be read.
    """
    usage = shutil.disk_usage(directory)
    return DiskSpace(usage.free, usage.total)


LESS_URGENT = 10
"""Niceness of a process whose work may be late."""
_FIRST_TO_GO = "1000"


def give_way() -> None:
    """Let this process run where others leave room.

    Its priority is so much lower (nice), and on Linux it is a batch: one that wakes
    takes no other's place on a processor (sched(7), ``SCHED_BATCH``).  Where memory
    runs out the kernel ends it, and not the server (proc_pid_oom_score_adj(5)).
    """
    os.nice(LESS_URGENT)
    if hasattr(os, "SCHED_BATCH"):
        # Some containers allow no change; being late is all that is lost.
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_FIRST_TO_GO)


_log = logging.getLogger(__name__)

_OWNER_ALONE = 0o600
RESERVE_BYTES = 2**20
"""Taken from the disk ahead for a file that a full disk must not end."""
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


def write_lines(path: Path, form: Form, values: Iterable[object]) -> os.stat_result:
    """Replace a file; a reader finds the old or the new one, never a part.

    Returns what the file is, as long as nobody else changes it.

    Raises:
        OSError: the disk did not take it; the old file stands.
    """
    lines = (orjson.dumps(value) + b"\n" for value in values)
    return write_bytes(path, form.line + b"".join(lines))


async def save_lines(path: Path, form: Form, values: Iterable[object]) -> None:
    """Replace a file in a thread; returns when it is on disk.

    Raises:
        HopError: the disk did not take it; the old file stands.
    """
    try:
        await asyncio.to_thread(write_lines, path, form, values)
    except OSError as error:
        raise HopError("disk", str(error)) from error


def write_bytes(path: Path, content: bytes) -> os.stat_result:
    """Replace a file by any content: written beside, synced, then moved.

    Raises:
        OSError: the disk did not take it; the old file stands.
    """
    beside = path.with_name(path.name + ".new")
    beside.unlink(missing_ok=True)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    try:
        with os.fdopen(os.open(beside, flags, _OWNER_ALONE), "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
            written = os.fstat(file.fileno())
        beside.replace(path)
    except OSError:
        # A full disk needs each byte.
        beside.unlink(missing_ok=True)
        raise
    directory = os.open(path.parent, os.O_RDONLY)
    try:
        # Else the move itself may be lost with the power.
        os.fsync(directory)
    finally:
        os.close(directory)
    return written


def read_lines(path: Path, form: Form) -> Iterator[tuple[int, bytes]]:
    """Every line but the first and empty ones, with its number; none without a file.

    Raises:
        DataFileError: it is something else, or a newer iVeg wrote it.
        OSError: it cannot be read.
    """
    try:
        # Zeros behind the last line are a reserve (``ReservedFile``).
        lines = path.read_bytes().rstrip(b"\0").splitlines()
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


class ReservedFile:
    """A file that grows by lines, each on the disk before ``append`` returns.

    Room for lines to come is taken from the disk ahead, as zeros behind the last line:
    a disk that is full later does not end it.

    Attributes:
        size: Bytes of its lines, once it is open.
    """

    def __init__(self, path: Path, form: Form) -> None:
        self.size = 0
        self._path = path
        self._form = form
        self._descriptor: int | None = None
        self._room = 0
        self._is_torn = False
        """The last line may be half written: the next one must not be glued to it."""

    def open(self) -> int:
        """Open it, made where it is missing, and take its reserve from the disk.

        Raises:
            OSError: it cannot be opened; likewise below.
        """
        if self._descriptor is None:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            if not self._path.exists():
                write_bytes(self._path, self._form.line)
            content = self._path.read_bytes()
            lines = content.rstrip(b"\0")
            self._is_torn = lines[-1:] not in (b"", b"\n")
            self.size, self._room = len(lines), len(content)
            self._descriptor = os.open(self._path, os.O_RDWR)
            self._keep_room(self._descriptor)
        return self._descriptor

    def append(self, lines: bytes) -> None:
        """Append whole lines; after an error none of them is in it."""
        descriptor = self.open()
        if self._is_torn:
            lines = b"\n" + lines
        try:
            written = os.pwrite(descriptor, lines, self.size)
            os.fsync(descriptor)
            if written != len(lines):
                raise OSError(f"{written} of {len(lines)} bytes written")
        except OSError:
            self.close()
            raise
        self.size += len(lines)
        self._is_torn = False
        self._keep_room(descriptor)

    def rewrite(self, lines: bytes) -> None:
        """Replace its lines; after an error the old ones stand."""
        write_bytes(self._path, self._form.line + lines + bytes(2 * RESERVE_BYTES))
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
        self.open()

    def close(self) -> None:
        """Let the file go, without its reserve; the next line opens it again."""
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self.size)
            os.close(self._descriptor)
            self._descriptor = None

    def _keep_room(self, descriptor: int) -> None:
        self._room = max(self._room, self.size)
        if self._room - self.size < RESERVE_BYTES:
            # Zeros are written out: a hole in a sparse file reserves nothing.
            wanted = bytes(self.size + 2 * RESERVE_BYTES - self._room)
            with contextlib.suppress(OSError):
                self._room += os.pwrite(descriptor, wanted, self._room)


@contextmanager
def lease(file: Path, what: str) -> Iterator[None]:
    """Hold a lock within ``with``; the kernel frees the lock of a killed process.

    Args:
        file: Where; its folder is made.
        what: Who is leased, for the refusal.

    Raises:
        HopError: somebody holds it.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    handle = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        _lock(handle, what)
        os.ftruncate(handle, 0)
        os.pwrite(handle, str(os.getpid()).encode(), 0)
        yield
    finally:
        os.close(handle)


def _lock(handle: int, what: str) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        held_by = os.pread(handle, 32, 0).decode(errors="replace").strip()
        detail = f"{what} is driven already, by process {held_by or '?'}"
        raise HopError("lease", detail) from error


class FileByRobot(Generic[_T]):
    """A value for each robot, in a small file that is replaced as a whole.

    Args:
        path: The file.
        name: What it holds; stands in its first line.
        reader: Reads a robot's id and value.
    """

    def __init__(
        self, path: Path, name: str, reader: TypeAdapter[tuple[str, _T]]
    ) -> None:
        self._path = path
        self._form = Form(name)
        self._reader = reader

    def load(self) -> Mapping[str, _T]:
        """The stored ones, by robot."""
        return dict(load_lines(self._path, self._form, self._reader.validate_json))

    async def save(self, known: Mapping[str, _T]) -> None:
        """Replace the stored ones; returns when they are on disk.

        Raises:
            HopError: the disk did not take them.
        """
        await save_lines(self._path, self._form, known.items())
