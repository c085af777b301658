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

_PATIENCE_S = 1.0
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
    broker = _Broker(
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


async def _close(broker: "_Broker") -> None:
    # A cancelled caller must not leave the broker half closed.
    await asyncio.shield(broker.close())


class _Broker(Broker):  # type: ignore[misc]
    """amqtt's broker, with the ends of its connections kept in hand.

    amqtt drops a connection whose client went away rudely without closing it; the
    socket would stay until the garbage collector complains.
    """

    def __init__(self, config: dict[str, object]) -> None:
        super().__init__(config)
        self._open: dict[asyncio.Task[None], asyncio.StreamWriter] = {}

    async def stream_connected(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        listener_name: str,
    ) -> None:
        """Serve one client to its end."""
        task = asyncio.current_task()
        assert task is not None  # noqa: S101 - asyncio starts servers' callbacks so
        self._open[task] = writer
        try:
            await super().stream_connected(reader, writer, listener_name)
        finally:
            writer.close()
            del self._open[task]

    async def close(self) -> None:
        """Stop serving; nothing of ours is left running."""
        # A client that never said CONNECT would keep a newer asyncio waiting for it.
        patience = asyncio.get_running_loop().call_later(_PATIENCE_S, self._hang_up)
        await self.shutdown()
        patience.cancel()
        self._hang_up()
        await asyncio.gather(*self._open, return_exceptions=True)

    def _hang_up(self) -> None:
        for task, writer in self._open.items():
            writer.transport.abort()
            task.cancel()
