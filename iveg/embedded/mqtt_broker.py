"""An MQTT broker inside the process, for greenhouses that have none yet.

amqtt does the work; this module gives it a loopback port, anonymous clients and quiet
logs, and takes it down without leaving anything behind.
"""

import asyncio
import logging
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from amqtt.broker import Broker

from iveg.embedded.loopback import require_loopback

for _name in ("amqtt", "transitions"):
    # Both tell every packet at INFO and DEBUG, which costs more than the packet.
    logging.getLogger(_name).setLevel(logging.WARNING)

_PLUGINS = {
    "amqtt.plugins.authentication.AnonymousAuthPlugin": {"allow_anonymous": True}
}


@asynccontextmanager
async def mqtt_broker(host: str, port: int) -> AsyncIterator[int]:
    """Run a broker while the block lasts.

    Args:
        host: A loopback address.
        port: TCP port; 0 for a free one.

    Yields:
        The port that is listened on.

    Raises:
        SettingsError: the address is not loopback.
        OSError: the port is taken.
    """
    host = require_loopback("IVEG_MQTT_URL", host)
    _require_free(host, port)
    shown = f"[{host}]" if ":" in host else host
    broker = Broker(
        {
            "listeners": {"default": {"type": "tcp", "bind": f"{shown}:{port}"}},
            "plugins": _PLUGINS,
        }
    )
    await broker.start()
    try:
        yield _port_of(broker)
    finally:
        await _close(broker)


def _require_free(host: str, port: int) -> None:
    # amqtt would log a traceback and raise an error that hides which port it was.
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((host, port))


def _port_of(broker: Broker) -> int:
    instance = broker._servers["default"].instance
    return int(instance.sockets[0].getsockname()[1])


async def _close(broker: Broker) -> None:
    # A cancelled caller must not leave the broker half closed.
    await asyncio.shield(broker.shutdown())
