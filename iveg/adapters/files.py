"""iVeg's own files, which are on the disk whole or not at all; locks, room, priority.

A file of JSON lines begins with a line that names its content and version; a file
without that line is of version 0.  A file of a newer iVeg is refused, and a file that
cannot be read is put aside.
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
    """Free and total space of a directory's disk.

    Raises:
        OSError: it cannot be read.
    """
    usage = shutil.disk_usage(directory)
    return DiskSpace(usage.free, usage.total)


LESS_URGENT = 10
"""Niceness of a process whose work may be late."""
_FIRST_TO_GO = "1000"


def give_way() -> None:
    """Give this process a lower priority than the server.

    Its niceness rises, and on Linux it is a batch process, which takes no other's
    place on a processor when it wakes (sched(7), ``SCHED_BATCH``).  Where memory runs
    out the kernel ends it, and not the server (proc_pid_oom_score_adj(5)).
    """
    os.nice(LESS_URGENT)
    if hasattr(os, "SCHED_BATCH"):
        # Some containers allow no change; then this process is only less polite.
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_FIRST_TO_GO)


_log = logging.getLogger(__name__)

_OWNER_ALONE = 0o600
RESERVE_BYTES = 2**20
"""Space reserved on the disk, for a file that must survive a full disk."""
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Form:
    """Content and version of a file: its first line."""

    name: str
    version: int = 1

    @property
    def line(self) -> bytes:
        """The first line of the file."""
        return orjson.dumps({"iveg": self.name, "version": self.version}) + b"\n"


def write_lines(path: Path, form: Form, values: Iterable[object]) -> os.stat_result:
    """Replace a file; a reader finds the old or the new one, never a part.

    Returns the status of the new file, to recognise later changes.

    Raises:
        OSError: the disk did not take it; the old file stands.
    """
    lines = (orjson.dumps(value) + b"\n" for value in values)
    return write_bytes(path, form.line + b"".join(lines))


@contextmanager
def disk_errors(hop: str = "disk") -> Iterator[None]:
    """Raise a refusal of the disk as HopError; around a block or a function."""
    try:
        yield
    except OSError as error:
        raise HopError(hop, error.strerror or str(error)) from error


async def save_lines(path: Path, form: Form, values: Iterable[object]) -> None:
    """Replace a file in a thread; returns when it is on disk.

    Raises:
        HopError: the disk did not take it; the old file stands.
    """
    with disk_errors():
        await asyncio.to_thread(write_lines, path, form, values)


def write_bytes(path: Path, content: bytes) -> os.stat_result:
    """Replace a file by any content: written beside, synced, then moved.

    Raises:
        OSError: the disk did not take it; the old file stands.
    """
    temporary = path.with_name(path.name + ".new")
    temporary.unlink(missing_ok=True)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    try:
        with os.fdopen(os.open(temporary, flags, _OWNER_ALONE), "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
            status = os.fstat(file.fileno())
        temporary.replace(path)
    except OSError:
        # A part of a file would only fill the disk further.
        temporary.unlink(missing_ok=True)
        raise
    directory = os.open(path.parent, os.O_RDONLY)
    try:
        # Without a sync of the folder a power cut may undo the move.
        os.fsync(directory)
    finally:
        os.close(directory)
    return status


def read_lines(path: Path, form: Form) -> Iterator[tuple[int, bytes]]:
    """Numbered lines of a file after its first, empty lines left out; none: no file.

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
    """Values of a file; a file with an unreadable line is put aside whole."""
    try:
        return [read(line) for _, line in read_lines(path, form)]
    except (ValidationError, DataFileError, OSError) as error:
        put_aside(path, type(error).__name__)
        return []


def _is_head(path: Path, form: Form, line: bytes) -> bool:
    """Whether the first line names content and version of the file."""
    head = None
    with contextlib.suppress(orjson.JSONDecodeError):
        head = orjson.loads(line)
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
    """Rename a damaged file, so that a person can examine it; returns the success."""
    new_path = path.with_name(f"{path.name}.{ending}")
    try:
        path.replace(new_path)
    except OSError as error:
        _log.error("%s: %s; cannot be put aside: %s", path, why, error)
        return False
    _log.error("%s: %s; put aside as %s", path, why, new_path.name)
    return True


def make_private(path: Path) -> None:
    """Let only the owner read a file; a missing file is made.

    A file that exists is not opened: closing it would drop SQLite's locks on it.

    Raises:
        OSError: it cannot be made.
    """
    try:
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _OWNER_ALONE))
    except FileExistsError:
        # Another owner decides who reads the file.
        with contextlib.suppress(PermissionError):
            path.chmod(_OWNER_ALONE)


class ReservedFile:
    """A file that grows by lines, each on the disk before ``append`` returns.

    Space for future lines is reserved on the disk, as zeros behind the last line:
    a disk that is full later does not stop it.

    Attributes:
        size: Size of its lines (bytes), once it is open.
    """

    def __init__(self, path: Path, form: Form) -> None:
        self.size = 0
        self._path = path
        self._form = form
        self._descriptor: int | None = None
        self._room = 0
        self._is_torn = False
        """Whether the last line may be half written; then a line break comes first."""

    def open(self) -> int:
        """Open or make the file, and take its reserve from the disk.

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
            size = os.pwrite(descriptor, lines, self.size)
            os.fsync(descriptor)
            if size != len(lines):
                raise OSError(f"{size} of {len(lines)} bytes written")
        except OSError:
            # Closing cuts off the bytes behind the last whole line.
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
        """Close the file without its reserve; the next line opens it again."""
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self.size)
            os.close(self._descriptor)
            self._descriptor = None

    def _keep_room(self, descriptor: int) -> None:
        self._room = max(self._room, self.size)
        if self._room - self.size < RESERVE_BYTES:
            # Zeros are written out: a hole in a sparse file reserves nothing.
            zeros = bytes(self.size + 2 * RESERVE_BYTES - self._room)
            with contextlib.suppress(OSError):
                self._room += os.pwrite(descriptor, zeros, self._room)


@contextmanager
def lease(file: Path, what: str) -> Iterator[None]:
    """Hold a lock within ``with``; the kernel frees the lock of a killed process.

    Args:
        file: Lock file; its folder is made.
        what: Thing that is leased, for the refusal.

    Raises:
        HopError: another process holds it.
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
        name: Name of its content, in its first line.
        reader: Reads a robot's id and value.
    """

    def __init__(
        self, path: Path, name: str, reader: TypeAdapter[tuple[str, _T]]
    ) -> None:
        self._path, self._form, self._reader = path, Form(name), reader

    def load(self) -> Mapping[str, _T]:
        """Stored values, by robot."""
        return dict(load_lines(self._path, self._form, self._reader.validate_json))

    async def save(self, known: Mapping[str, _T]) -> None:
        """Replace the stored values; returns when they are on disk.

        Raises:
            HopError: the disk did not take them.
        """
        await save_lines(self._path, self._form, known.items())
