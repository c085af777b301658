"""Runs a part in the foreground until it is ended.

Ctrl-C, SIGTERM and, with ``--until-eof``, the end of the standard input end a part the
same way: it is cancelled, cleans up, and exits with code 0.
"""

import asyncio
import contextlib
import gc
import os
import signal
import socket
import sys
from collections.abc import Coroutine

import segno
import uvloop

from iveg.settings import Settings

EVERY_ADDRESS = ("0.0.0.0", "::")  # noqa: S104 - told apart, not bound
LOOPBACK = ("127.0.0.1", "localhost", "::1")


def run_until_stopped(
    work: Coroutine[object, object, None], *, until_eof: bool = False
) -> int:
    """Run until the end or the first signal; returns the exit code."""
    return uvloop.run(_guard(work, until_eof=until_eof))


async def _guard(work: Coroutine[object, object, None], *, until_eof: bool) -> int:
    loop = asyncio.get_running_loop()
    task = asyncio.create_task(work, name="part")
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, task.cancel)
    if until_eof:
        loop.add_reader(sys.stdin.fileno(), _read, loop, task)
    with contextlib.suppress(asyncio.CancelledError):
        await task
    return 0


def _read(loop: asyncio.AbstractEventLoop, task: asyncio.Task[None]) -> None:
    """Read standard input, which gets no data: its end is the parent's end."""
    if not os.read(sys.stdin.fileno(), 1024):
        loop.remove_reader(sys.stdin.fileno())
        task.cancel()


def sign_in_link(settings: Settings, token: str) -> str:
    """Address that signs a browser in; the token after ``#`` is never sent by HTTP."""
    return f"{page_address(settings)}/signin#token={token}"


def page_address(settings: Settings) -> str:
    """Address of the page for other machines."""
    host = reachable_host(settings.host)
    host = f"[{host}]" if ":" in host else host
    return f"http://{host}:{settings.port}"


def reachable_host(host: str) -> str:
    """Address of a server for other machines; for "all addresses" a routed one."""
    if host not in EVERY_ADDRESS:
        return host
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # Addresses for documentation (RFC 3849, RFC 5737): no machine has them.
    somewhere = "2001:db8::1" if ":" in host else "192.0.2.1"
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            # Nothing is sent: the system only chooses the route.
            probe.connect((somewhere, 9))
        except OSError:
            return "localhost"
        return str(probe.getsockname()[0])


def print_sign_in_link(settings: Settings, token: str) -> None:
    """Print the sign-in link; on a terminal also as a code for a phone."""
    link = sign_in_link(settings, token)
    print(f"iVeg: {link}", flush=True)
    if sys.stdout.isatty():
        segno.make(link, micro=False).terminal(compact=True)


def report_ready() -> None:
    """Report on standard output that this part is ready."""
    print("ready", flush=True)


_YOUNG, _MIDDLE, _OLD = 700, 500, 50


def tune_garbage_collection() -> None:
    """Exclude all present objects from collection; call it when everything is built.

    The MQTT library leaves a cycle for each message.  So the youngest objects are
    collected as often as by default, in a millisecond.  Older ones are collected
    seldom: each time the event loop stands for a twentieth of a second.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(_YOUNG, _MIDDLE, _OLD)
