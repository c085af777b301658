import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass

import aiomqtt
import pytest

from iveg.adapters.iot_agent import DEVICES, IotAgentClient
from iveg.adapters.orion import REGISTRATIONS, OrionClient
from iveg.adapters.reconciler import FiwareSite, Reconciled, provision
from iveg.lab.embedded.context_broker import Registration
from iveg.lab.embedded.entities import new_id
from iveg.lab.embedded.server import Running, embedded_fiware
from iveg.ngsi import names

TENANT = ("agroconnect", "/greenhouse")
STOP = {"stop": {"id": "01JCZZ", "by": "tester"}}


@dataclass
class Site:
    """An embedded FIWARE and our clients of it."""

    up: Running
    agent: IotAgentClient
    orion: OrionClient

    async def provision(self, *robots: str) -> Reconciled:
        return await provision(
            self.agent, self.orion, FiwareSite(robots, "iveg", self.up.orion_url)
        )

    async def command_arrives(self, robot_id: str) -> bool:
        """Whether a command sent through Orion is heard at the robot's topic."""
        async with aiomqtt.Client("127.0.0.1", self.up.mqtt_port) as mqtt:
            await mqtt.subscribe(names.command_topic("iveg", robot_id), qos=1)
            await self.orion.update_command(robot_id, STOP)
            # The direct message comes after the command, if the command comes at all.
            await mqtt.publish(names.command_topic("iveg", robot_id), b"end", qos=1)
            async with asyncio.timeout(30):
                message = await anext(aiter(mqtt.messages))
        return message.payload != b"end"


@pytest.fixture
async def site() -> AsyncIterator[Site]:
    async with (
        embedded_fiware() as up,
        IotAgentClient(up.iota_url, *TENANT) as agent,
        OrionClient(up.orion_url, *TENANT) as orion,
    ):
        yield Site(up, agent, orion)


async def test_all_devices_are_made_and_the_command_device_last(site: Site) -> None:
    await site.provision("AGI")
    made = [
        one["device_id"] for one in await site.agent.read_all(DEVICES, part="devices")
    ]
    robots = [one for one in made if one.startswith("AGI")]
    assert set(robots) == {"AGI" + device.suffix for device in names.ROBOT_DEVICES}
    assert set(made) - set(robots) == {"climate", "iveg-canary"}
    assert (robots[-1], made[-1]) == ("AGI", "iveg-canary")


async def test_a_device_that_drifted_is_made_anew(site: Site) -> None:
    await site.provision("AGI")
    await site.agent.delete(f"{DEVICES}/AGI_odom")
    drifted = {"device_id": "AGI_odom", "apikey": "iveg", "entity_name": "OTHER"}
    await site.agent.create(DEVICES, {"devices": [drifted]})
    mended = (await site.provision("AGI")).mended
    assert mended == ("Made anew device AGI_odom.", "Made anew device AGI.")
    assert (await site.provision("AGI")).mended == ()


async def unregister(site: Site) -> None:
    """As where the agent never told Orion of the command."""
    (registration,) = await site.orion.read_all(REGISTRATIONS)
    await site.orion.delete(f"{REGISTRATIONS}/{registration['id']}")


async def shadow(site: Site) -> None:
    """Orion keeps an attribute of the name of the command, and forwards nothing."""
    body = {"id": "AGI", "type": "Robot", "cmd": {"type": "command", "value": ""}}
    await site.orion.ask("POST", "/v2/entities", query={"options": "upsert"}, body=body)
    assert not await site.command_arrives("AGI")


async def forget(site: Site) -> None:
    """An agent that lost its devices leaves its registration at Orion."""
    entity = TENANT[1], "AGI", "Robot", ("cmd",)
    agent = site.up.agent
    old = Registration(new_id(), *entity, "http://127.0.0.1:1", agent.command)
    await site.agent.delete(f"{DEVICES}/AGI")
    site.up.broker.tenant(TENANT[0]).registrations[old.id] = old


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (unregister, "Made anew device AGI."),
        (shadow, "Deleted attribute cmd of AGI"),
        (forget, "Removed an old registration of the command of AGI."),
    ],
)
async def test_a_command_that_has_lost_its_road_gets_it_back(
    site: Site, damage: Callable[[Site], Awaitable[None]], told: str
) -> None:
    await site.provision("AGI")
    await damage(site)

    mended = (await site.provision("AGI")).mended

    assert any(one.startswith(told) for one in mended)
    assert await site.command_arrives("AGI")


async def test_a_foreign_device_on_the_entity_is_told_and_left_alone(
    site: Site,
) -> None:
    await site.provision("AGI")
    gps = {
        "device_id": "AAA_gps",
        "apikey": "iveg",
        "entity_name": "AGI",
        "entity_type": "Robot",
    }
    await site.agent.create(DEVICES, {"devices": [gps]})
    told = await site.provision("AGI")
    assert told.mended == ()
    assert told.problems[0].startswith("Device AAA_gps also feeds AGI")
