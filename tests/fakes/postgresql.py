"""A private PostgreSQL server for tests, in a directory and on a port of its own."""

import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import psycopg
from psycopg.sql import SQL, Identifier

from iveg.adapters.history.engine import upgrade
from tests.bonds import bound
from tests.ports import free_ports
from tests.processes import until

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
        self._copies: list[Identifier] = []

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
        options = {
            "listen_addresses": "127.0.0.1",
            "fsync": "off",
            "unix_socket_directories": str(self._directory),
        }
        words = [f"--{name}={value}" for name, value in options.items()]
        program = str(self._bin / "postgres")
        with (self._directory / "log").open("ab") as log:
            self._server = subprocess.Popen(
                bound(program, "-D", str(self._data), "-p", str(self._port), *words),
                stdout=log,
                stderr=log,
                cwd=self._directory,
                **_other_user(),
            )
        until(self._answers, "PostgreSQL answers")

    def stop(self) -> None:
        """Stop this very server at once, as a crash would."""
        self._server.send_signal(signal.SIGQUIT)
        self._server.wait(_WAIT_S)

    def _answers(self) -> bool:
        assert self._server.poll() is None, (self._directory / "log").read_text()
        try:
            psycopg.connect(self._address).close()
        except psycopg.OperationalError:
            return False
        return True

    @property
    def _address(self) -> str:
        return self._address_of("postgres")

    def _address_of(self, database: str) -> str:
        return f"postgresql://postgres@127.0.0.1:{self._port}/{database}"

    def empty_database(self) -> str:
        """The address of the one database, emptied: far cheaper than a new one."""
        with psycopg.connect(self._address) as connection:
            connection.execute("DROP SCHEMA public CASCADE")
            connection.execute("CREATE SCHEMA public")
        return self._address

    def newest_database(self) -> str:
        """The address of a database of its own with an empty history in it.

        The one before is gone.
        """
        with psycopg.connect(self._address, autocommit=True) as connection:
            if not self._copies:
                connection.execute("CREATE DATABASE newest")
                upgrade(self._address_of("newest"))
            for old in self._copies[-1:]:
                connection.execute(SQL("DROP DATABASE {} WITH (FORCE)").format(old))
            copy = f"copy{len(self._copies)}"
            self._copies.append(Identifier(copy))
            connection.execute(
                SQL("CREATE DATABASE {} TEMPLATE newest").format(self._copies[-1])
            )
        return self._address_of(copy)

    def _run(self, program: str, *words: str) -> None:
        subprocess.run(
            [self._bin / program, *words],
            check=True,
            stdout=subprocess.DEVNULL,
            cwd=self._directory,
            **_other_user(),
        )


def _other_user() -> dict[str, Any]:
    """The server refuses to run as root; continuous integration is root."""
    if os.geteuid() != 0:
        return {}
    return {"user": "postgres", "group": "postgres", "extra_groups": []}


@contextmanager
def running_postgresql(bin_: Path) -> Iterator[PostgreSQL]:
    """A server that is gone afterwards, with its files."""
    with tempfile.TemporaryDirectory(prefix="iveg-pg-") as name:
        directory = Path(name)
        if os.geteuid() == 0:
            shutil.chown(directory, "postgres", "postgres")
        with PostgreSQL(directory, bin_) as server:
            yield server
