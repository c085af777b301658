"""All three embedded parts in one process: MQTT broker, context broker, IoT Agent."""

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from ipaddress import ip_address

import uvicorn
from starlette.types import ASGIApp

from iveg.domain.errors import SettingsError
from iveg.lab.embedded.context_broker import ContextBroker, ngsi_api
from iveg.lab.embedded.iot_agent import IotAgent
from iveg.lab.embedded.mqtt_broker import MqttBroker, mqtt_broker

Address = tuple[str, int]
_LONGEST_HEAD = 16_384
_KEPT_S = 60
_GRACE_S = 1.0


@dataclass(frozen=True, slots=True)
class Running:
    """A running embedded FIWARE.

    Attributes:
        mqtt_port: Port of the MQTT broker.
        orion_url: Address of the context broker.
        iota_url: Address of the agent's north port.
        broker: For inspection.
        agent: For inspection.
    """

    mqtt_port: int
    orion_url: str
    iota_url: str
    broker: ContextBroker
    agent: IotAgent


@asynccontextmanager
async def embedded_fiware(
    mqtt: Address = ("127.0.0.1", 0),
    orion: Address = ("127.0.0.1", 0),
    iota: Address = ("127.0.0.1", 0),
    *,
    make_agent: Callable[[ContextBroker, MqttBroker], IotAgent] = IotAgent,
) -> AsyncIterator[Running]:
    """Run all three while the block lasts; port 0 takes a free one.

    Args:
        mqtt: Host and port of the MQTT broker.
        orion: Host and port of the context broker.
        iota: Host and port of the agent's north side.
        make_agent: Gives the agent.

    Raises:
        SettingsError: an address that is not loopback.
        OSError: a port that is taken.
    """
    mqtt_host = require_loopback("IVEG_MQTT_URL", mqtt[0])
    orion_host = require_loopback("IVEG_ORION_URL", orion[0])
    iota_host = require_loopback("IVEG_IOTA_URL", iota[0])
    async with AsyncExitStack() as stack:
        south = await stack.enter_async_context(mqtt_broker(mqtt_host, mqtt[1]))
        broker = ContextBroker()
        stack.callback(broker.close)
        agent = make_agent(broker, south)
        orion_port = await stack.enter_async_context(
            http_server(ngsi_api(broker), orion_host, orion[1])
        )
        iota_port = await stack.enter_async_context(
            http_server(agent.north_port(), iota_host, iota[1])
        )
        agent.url = f"http://{iota_host}:{iota_port}"
        orion_url = f"http://{orion_host}:{orion_port}"
        yield Running(south.port, orion_url, agent.url, broker, agent)


@asynccontextmanager
async def http_server(app: ASGIApp, host: str, port: int) -> AsyncIterator[int]:
    """Serve an application beside others in this loop, while the block lasts.

    Args:
        app: Answers requests.
        host: Address to bind.
        port: TCP port; 0 for a free one.

    Yields:
        The port in use.

    Raises:
        OSError: the port is taken.
    """
    config = uvicorn.Config(
        app,
        # Unlike httptools it bounds a head.
        http="h11",
        h11_max_incomplete_event_size=_LONGEST_HEAD,
        ws="none",
        lifespan="off",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        timeout_keep_alive=_KEPT_S,
    )
    config.load()
    server = uvicorn.Server(config)
    server.lifespan = config.lifespan_class(config)
    with socket.create_server((host, port)) as listener:
        # Not ``serve``, which takes the process's signals.
        await server.startup([listener])
        try:
            yield int(listener.getsockname()[1])
        finally:
            await _end(server)


async def _end(server: uvicorn.Server) -> None:
    """Close listener and connections; running answers get a second to end.

    ``Server.shutdown`` waits for at least 0.1 s, which each test would pay twice.
    """
    for listener in server.servers:
        listener.close()
    if answering := list(server.server_state.tasks):
        _, late = await asyncio.wait(answering, timeout=_GRACE_S)
        for task in late:
            task.cancel()
        await asyncio.gather(*late, return_exceptions=True)
    for connection in list(server.server_state.connections):
        connection.shutdown()
    # The loop closes their sockets before it comes back here.
    await asyncio.sleep(0)


def require_loopback(setting: str, host: str) -> str:
    """The host, if only this machine reaches it: nobody signs in here.

    Raises:
        SettingsError: any other address; names the setting.
    """
    if host == "localhost":
        return "127.0.0.1"
    try:
        usable = ip_address(host).is_loopback
    except ValueError:
        usable = False
    if not usable:
        raise SettingsError(
            setting,
            host,
            "a loopback address such as 127.0.0.1, because the embedded FIWARE "
            "asks nobody who they are",
        )
    return host
