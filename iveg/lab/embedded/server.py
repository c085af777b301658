"""All three embedded parts in one process: MQTT broker, context broker, IoT Agent."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from ipaddress import ip_address

from iveg.adapters import clock
from iveg.domain.errors import SettingsError
from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.http_server import http_server
from iveg.lab.embedded.iot_agent import IotAgent
from iveg.lab.embedded.iota_api import IotaApi
from iveg.lab.embedded.mqtt_broker import MqttBroker
from iveg.lab.embedded.mqtt_server import mqtt_broker
from iveg.lab.embedded.ngsi_api import NgsiApi

Address = tuple[str, int]
MakeAgent = Callable[[ContextBroker, MqttBroker], IotAgent]
MakeApi = Callable[[IotAgent], IotaApi]


@dataclass(frozen=True, slots=True)
class Running:
    """A running embedded FIWARE.

    Attributes:
        mqtt_port: Port of the MQTT broker.
        orion_port: NGSI-v2.
        iota_port: North port of the agent.
        broker: For inspection.
        agent: For inspection.
    """

    mqtt_port: int
    orion_port: int
    iota_port: int
    broker: ContextBroker
    agent: IotAgent

    @property
    def mqtt_url(self) -> str:
        """Address of the MQTT broker."""
        return f"mqtt://127.0.0.1:{self.mqtt_port}"

    @property
    def orion_url(self) -> str:
        """Address of the context broker."""
        return f"http://127.0.0.1:{self.orion_port}"

    @property
    def iota_url(self) -> str:
        """Address of the agent's north port."""
        return f"http://127.0.0.1:{self.iota_port}"


@asynccontextmanager
async def embedded_fiware(
    mqtt: Address = ("127.0.0.1", 0),
    orion: Address = ("127.0.0.1", 0),
    iota: Address = ("127.0.0.1", 0),
    *,
    make_agent: MakeAgent = IotAgent,
    make_api: MakeApi = IotaApi,
) -> AsyncIterator[Running]:
    """Run all three while the block lasts; port 0 takes a free one.

    Args:
        mqtt: Host and port of the MQTT broker.
        orion: Host and port of the context broker.
        iota: Host and port of the agent's north side.
        make_agent: Gives the agent; ``make_api`` its north port.
        make_api: See above.

    Raises:
        SettingsError: an address that is not loopback.
        OSError: a port that is taken.
    """
    mqtt_host = require_loopback("IVEG_MQTT_URL", mqtt[0])
    orion_host = require_loopback("IVEG_ORION_URL", orion[0])
    iota_host = require_loopback("IVEG_IOTA_URL", iota[0])
    async with AsyncExitStack() as stack:
        south = await stack.enter_async_context(mqtt_broker(mqtt_host, mqtt[1]))
        broker = ContextBroker(clock.wall())
        stack.callback(broker.close)
        agent = make_agent(broker, south)
        api = NgsiApi(broker)
        orion_port = await stack.enter_async_context(
            http_server(api.handle, orion_host, orion[1])
        )
        iota_port = await stack.enter_async_context(
            http_server(make_api(agent).handle, iota_host, iota[1])
        )
        agent.url = f"http://{iota_host}:{iota_port}"
        yield Running(south.port, orion_port, iota_port, broker, agent)


async def serve_fiware(
    mqtt: Address,
    orion: Address,
    iota: Address,
    *,
    notify_ready: Callable[[], None],
    make_agent: MakeAgent = IotAgent,
    make_api: MakeApi = IotaApi,
) -> None:
    """Run the embedded FIWARE until cancelled.

    Args:
        mqtt: Host and port of the MQTT broker.
        orion: Host and port of the context broker.
        iota: Host and port of the agent's north side.
        notify_ready: Called once when all three take requests.
        make_agent: Gives the agent; ``make_api`` its north port.
        make_api: See above.

    Raises:
        SettingsError: an address that is not loopback.
        OSError: a port that is taken.
    """
    running = embedded_fiware(
        mqtt, orion, iota, make_agent=make_agent, make_api=make_api
    )
    async with running:
        notify_ready()
        await asyncio.Event().wait()


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
