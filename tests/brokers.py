"""A broker for a test: Mosquitto where it is installed, the embedded one elsewhere."""

import asyncio
import contextlib
import os
import shutil
import time
from collections.abc import AsyncIterator
from pathlib import Path

from iveg.adapters.mqtt import BrokerAddress
from iveg.lab.embedded.mqtt_broker import mqtt_broker
from tests.bonds import bound

MOSQUITTO = shutil.which("mosquitto", path=f"{os.environ['PATH']}:/usr/sbin")
PLAIN = """listener {port} 127.0.0.1
allow_anonymous true
set_tcp_nodelay true
log_type none
""" + ("user root\n" if os.geteuid() == 0 else "")
"""A plain one on a port; root's stays root's, so that it ends with who started it."""


@contextlib.asynccontextmanager
async def broker_on(port: int, folder: Path) -> AsyncIterator[BrokerAddress]:
    """A broker on this port of loopback, listening, until the block ends."""
    address = BrokerAddress("127.0.0.1", port)
    if MOSQUITTO is None:
        async with mqtt_broker("127.0.0.1", port):
            yield address
        return
    conf = folder / "mosquitto.conf"
    conf.write_text(PLAIN.format(port=port))
    words = bound(MOSQUITTO, "-c", str(conf))
    process = await asyncio.create_subprocess_exec(*words)
    try:
        await _listening(port)
        yield address
    finally:
        process.kill()
        await process.wait()


async def _listening(port: int) -> None:
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError):
            _, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.close()
            return
        await asyncio.sleep(0.02)
    raise AssertionError(f"no broker listens on {port}")
