"""Somebody holds a thousand half-sent requests open, and sends a header without end."""

import contextlib
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx

from tests.processes import Site

MEGABYTE = 1 << 20
HALF = b"POST /api/v1/robots/AGI/stop HTTP/1.1\r\nHost: iveg\r\nX: "


@contextmanager
def connected(site: Site) -> Iterator[socket.socket]:
    place = "127.0.0.1", int(site.settings["IVEG_PORT"])
    with socket.create_connection(place, 10.0) as line:
        yield line


def resident(pid: int) -> int:
    """Memory of a process (bytes)."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    fields = dict(line.split(":", 1) for line in lines)
    return int(fields["VmRSS"].split()[0]) * 1024


def sent(line: socket.socket, most: int) -> int:
    """Bytes of an endless header that a server takes before it hangs up."""
    count = 0
    line.sendall(HALF)
    with contextlib.suppress(ConnectionError):
        while count < most:
            count += line.send(b"a" * 65_536)
    return count


def answered_s(client: httpx.Client, method: str, path: str, status: int) -> float:
    """How long a new connection takes from its opening to the answer (s)."""
    began = time.monotonic()
    answer = client.request(method, path, headers={"Connection": "close"})
    assert answer.status_code == status
    return time.monotonic() - began


def test_f59_a_stop_gets_through_a_thousand_half_sent_requests(served: Site) -> None:
    program = served.programs[-1]
    page = {"X-IVEG": "1", "Origin": served.url}
    with ExitStack() as stack:
        client = httpx.Client(base_url=served.url, headers=page, trust_env=False)
        operator = stack.enter_context(client)
        assert operator.get(served.sign_in_link).status_code == 303
        before = resident(program.pid)
        for _ in range(1000):
            stack.enter_context(connected(served)).sendall(HALF)

        assert answered_s(operator, "POST", "/api/v1/robots/AGI/stop", 202) < 1.0

        taken = sent(stack.enter_context(connected(served)), 60 * MEGABYTE)
        assert taken < 10 * MEGABYTE
        assert answered_s(operator, "GET", "/healthz", 200) < 1.0
        assert resident(program.pid) - before < 20 * MEGABYTE
    assert program.process.poll() is None
    assert [line for line in program.complaints() if "connections of" not in line] == []
    program.forgive()
