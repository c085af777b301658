"""A Python that has imported iVeg's programs, and becomes one each time it is asked.

Tests start some 200 of them: imports were up to two of the seconds of processor time of
each start.  A copy of this process (``fork``) is a process of its own as before, and
runs the same ``main`` with arguments, environment, directory and log of its own.

``python -m tests.forge`` reads requests from the socket at its standard input and ends
with it.  ``iveg demo``, ``iveg experiment`` and all that they start begin anew.
"""

import atexit
import contextlib
import ctypes
import gc
import json
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO
from unittest.mock import patch

PROGRAMS = ("serve", "fiware", "emulator", "robot")
PARTS = (
    *("iveg.cli.robot", "iveg.cli.serve"),
    *("iveg.lab.commands.emulator", "iveg.lab.commands.fiware"),
    *("anyio._backends._asyncio", "httpcore", "numpy.ma"),
)
"""What is there when it forks; the last are libraries that are else loaded late."""
_PARENT_DIES = 1
"""``PR_SET_PDEATHSIG`` of Linux: what dies with its parent (tests/bonds.py)."""
_MOST_BYTES = 1 << 17


@dataclass
class Forked:
    """A program that was forked; the members of ``Popen`` that tests use."""

    words: Sequence[str]
    pid: int
    ended: BinaryIO = field(repr=False)
    """Here the forge writes the exit status."""
    returncode: int | None = None

    def poll(self) -> int | None:
        """The exit status; None while it runs."""
        return self._read(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """Until it has ended; the exit status.

        Raises:
            subprocess.TimeoutExpired: not within ``timeout`` seconds.
        """
        status = self._read(timeout)
        if status is None:
            raise subprocess.TimeoutExpired(list(self.words), timeout or 0.0)
        return status

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def _read(self, timeout: float | None) -> int | None:
        if self.returncode is None and select.select([self.ended], [], [], timeout)[0]:
            # Nothing: the forge has died, and its programs with it.
            self.returncode = int(self.ended.readline() or -signal.SIGKILL)
            self.ended.close()
        return self.returncode


def fork(
    words: Sequence[str], directory: Path, environment: Mapping[str, str], output: int
) -> Forked:
    """Start ``iveg WORD …`` in a directory; it writes to a file descriptor."""
    reading, writing = os.pipe()
    request = json.dumps([list(words), str(directory), dict(environment)]).encode()
    socket.send_fds(_forge(), [request], [output, writing])
    os.close(writing)
    told = os.fdopen(reading, "rb", buffering=0)
    return Forked(words, int(told.readline()), told)


@cache
def _forge() -> socket.socket:
    ours, theirs = socket.socketpair(type=socket.SOCK_SEQPACKET)
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "tests.forge"],
        cwd=Path(__file__).parents[1],
        stdin=theirs.fileno(),
        start_new_session=True,
    )
    theirs.close()
    atexit.register(_end, ours, process)
    return ours


def _end(requests: socket.socket, process: subprocess.Popen[bytes]) -> None:
    requests.close()
    process.wait()


def main() -> None:
    """Fork what is asked for, and say of each how it ended."""
    ended: list[int] = []
    # The first that is registered is the last that is called.
    atexit.register(_leave, ended)
    import iveg.__main__ as program

    for part in PARTS:
        import_module(part)
    patch("shutil.disk_usage", _disk_usage).start()
    # Else each copy looks through all of it, and so comes to own what it would share.
    gc.collect()
    gc.freeze()
    # A process that is spawned begins with the main module, as it does in earnest.
    sys.modules["__main__"] = program
    asked = _become_what_is_asked()
    if asked is not None:
        sys.argv = ["iveg", *asked]
        try:
            program.run()
        except SystemExit as end:
            if not isinstance(end.code, int):
                raise
            ended.append(end.code)


def _disk_usage(folder: Path, real: Any = shutil.disk_usage) -> Any:
    """Room for recordings, however full the machine's disk is."""
    usage = real(folder)
    # A small disk is a test's own.
    return usage if usage.total < 10**9 else usage._replace(free=10**12)


def _leave(ended: list[int]) -> None:
    """After all that a program does at its end: leave its memory to the system.

    To free each object takes 90 ms of a processor.  Programs that do not begin here
    free them, and their logs are read, too.
    """
    if ended:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(ended[0])


def _become_what_is_asked() -> list[str] | None:
    """In a copy: its arguments.  In the forge itself: None, once nobody asks more."""
    requests = socket.socket(fileno=os.dup(0))
    alive: dict[int, tuple[int, int]] = {}
    while True:
        ready = select.select([requests.fileno(), *alive], [], [])[0][0]
        if ready in alive:
            _tell_the_end(ready, *alive.pop(ready))
            continue
        message, fds, _, _ = socket.recv_fds(requests, _MOST_BYTES, 2)
        if not message:
            return None
        output, ended = fds
        pid = os.fork()
        if pid == 0:
            requests.close()
            for other in (ended, *alive, *(pipe for _, pipe in alive.values())):
                os.close(other)
            return _settle(output, *json.loads(message))
        os.close(output)
        os.write(ended, f"{pid}\n".encode())
        alive[os.pidfd_open(pid)] = (pid, ended)


def _tell_the_end(watch: int, pid: int, ended: int) -> None:
    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    # Whoever started it may be gone.
    with contextlib.suppress(BrokenPipeError):
        os.write(ended, f"{status}\n".encode())
    os.close(ended)
    os.close(watch)


def _settle(
    output: int, words: list[str], directory: str, environment: dict[str, str]
) -> list[str]:
    """Take what a new process would have been given; its arguments."""
    # Ctrl-C in the terminal of the tests is not Ctrl-C here.
    os.setsid()
    ctypes.CDLL(None).prctl(_PARENT_DIES, signal.SIGKILL)
    os.chdir(directory)
    os.environ.clear()
    os.environ.update(environment)
    nothing = os.open(os.devnull, os.O_RDONLY)
    for source, target in ((nothing, 0), (output, 1), (output, 2)):
        os.dup2(source, target)
    os.close(nothing)
    os.close(output)
    return words


if __name__ == "__main__":
    main()
