"""A private PostgreSQL server for tests, in a directory and on a port of its own."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

import psycopg

from tests.ports import free_ports

_WAIT_S = 30


def programs() -> Path | None:
    """Where the server's programs are; None when it is not installed."""
    found = shutil.which("initdb")
    if found is not None:
        return Path(found).parent
    return max(Path("/usr/lib/postgresql").glob("*/bin"), default=None)


class PostgreSQL:
    """A running server with no password and no regard for power cuts."""

    def __init__(self, directory: Path, bin_: Path) -> None:
        self._data, self._bin, self._directory = directory / "data", bin_, directory
        (self._port,) = free_ports(1)

    def __enter__(self) -> Self:
        self._run(
            "initdb", "-D", str(self._data), "-U", "postgres", "-A", "trust", "-N"
        )
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def start(self) -> None:
        """Start, and return when it answers."""
        options = (
            f"-p {self._port} -c listen_addresses=127.0.0.1 -c fsync=off "
            f"-c unix_socket_directories={self._directory}"
        )
        log = str(self._directory / "log")
        self._control("start", "-l", log, "-o", options, "-t", str(_WAIT_S))

    def stop(self) -> None:
        """Stop this very server at once, as a crash would."""
        self._control("stop", "-m", "immediate")

    def empty_database(self) -> str:
        """The address of the one database, emptied: far cheaper than a new one."""
        address = f"postgresql://postgres@127.0.0.1:{self._port}/postgres"
        with psycopg.connect(address) as connection:
            connection.execute("DROP SCHEMA public CASCADE")
            connection.execute("CREATE SCHEMA public")
        return address

    def _control(self, *words: str) -> None:
        self._run("pg_ctl", "-D", str(self._data), "-w", *words)

    def _run(self, program: str, *words: str) -> None:
        # The server refuses to run as root; continuous integration is root.
        user = "postgres" if os.geteuid() == 0 else None
        subprocess.run(
            [self._bin / program, *words],
            check=True,
            stdout=subprocess.DEVNULL,
            cwd=self._directory,
            user=user,
            group=user,
            extra_groups=None if user is None else [],
        )


@contextmanager
def running_postgresql(bin_: Path) -> Iterator[PostgreSQL]:
    """A server that is gone afterwards, with its files."""
    with tempfile.TemporaryDirectory(prefix="iveg-pg-") as name:
        directory = Path(name)
        if os.geteuid() == 0:
            shutil.chown(directory, "postgres", "postgres")
        with PostgreSQL(directory, bin_) as server:
            yield server
