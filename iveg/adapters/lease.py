"""One program for each robot of a machine: a lock that ends with its process."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from iveg.domain.errors import HopError


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
