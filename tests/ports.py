"""Ports that no other test has, in this process or in another.

Tests run side by side, also those of other clones on the same machine.  Each process
takes its ports from below those that a system gives to outgoing connections, and marks
each as taken by a lock on one byte of a file; the locks end with the process.
"""

import fcntl
import itertools
import os
import secrets
import socket
import tempfile
from pathlib import Path

_FIRST, _COUNT = 15_000, 15_000
_order = itertools.count(secrets.randbelow(_COUNT))
_marks = os.open(
    Path(tempfile.gettempdir(), f"iveg-test-ports-{os.getuid()}"),
    os.O_RDWR | os.O_CREAT,
)


def free_ports(count: int) -> tuple[int, ...]:
    """Loopback ports that nobody listens on or will be given, all different."""
    candidates = (_FIRST + number % _COUNT for number in _order)
    return tuple(itertools.islice(filter(_claim, candidates), count))


def _claim(port: int) -> bool:
    try:
        fcntl.lockf(_marks, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, port)
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", port))
    except OSError:
        return False
    return True
