"""One program for each robot of a machine: a lock that ends with its process."""

import fcntl
import os
from pathlib import Path
from types import TracebackType

from iveg.domain.errors import HopError


class Lease:
    """A lock held within ``with``; the kernel frees the lock of a killed process.

    Args:
        file: Where; its folder is made.
        what: Who is leased, for the refusal.
    """

    def __init__(self, file: Path, what: str) -> None:
        self._file, self._what = file, what
        self._handle: int | None = None

    def __enter__(self) -> "Lease":
        """Take it.

        Raises:
            HopError: somebody holds it.
        """
        self._file.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(self._file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            held_by = os.pread(handle, 32, 0).decode(errors="replace").strip()
            os.close(handle)
            detail = f"{self._what} is driven already, by process {held_by or '?'}"
            raise HopError("lease", detail) from error
        os.ftruncate(handle, 0)
        os.pwrite(handle, str(os.getpid()).encode(), 0)
        self._handle = handle
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
