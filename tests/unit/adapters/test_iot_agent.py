import asyncio
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Any

import aiomqtt
import pytest

from iveg.adapters.fleet_provisioning import Provisioned, provision
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.orion import OrionClient
from iveg.domain.errors import HopError
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

    async def provision(self, *robots: str) -> Provisioned:
        return await provision(
            self.agent, self.orion, robots, "iveg", self.up.orion_url
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


async def read_soon(orion: OrionClient, kind: str, name: str) -> list[dict[str, Any]]:
    deadline = time.monotonic() + 30
    found: list[dict[str, Any]] = []
    while not found and time.monotonic() < deadline:
        found = await orion.read_entities(kind, [name])
    return found


@pytest.fixture
async def site() -> AsyncIterator[Site]:
    async with (
        embedded_fiware() as up,
        IotAgentClient(up.iota_url, *TENANT) as agent,
        OrionClient(up.orion_url, *TENANT) as orion,
    ):
        yield Site(up, agent, orion)


async def test_a_provisioned_fleet_hears_its_commands(site: Site) -> None:
    await site.provision("AGI", "AGII")
    assert await site.command_arrives("AGI")
    assert await site.command_arrives("AGII")


async def test_all_devices_are_made_and_the_command_device_last(site: Site) -> None:
    await site.provision("AGI")
    made = [one["device_id"] for one in await site.agent.read_devices()]
    assert set(made) == {
        "climate",
        "iveg-canary",
        *("AGI" + device.suffix for device in names.ROBOT_DEVICES),
    }
    assert [one for one in made if one.startswith("AGI")][-1] == "AGI"
    assert made[-1] == "iveg-canary"
    assert min(one for one in made if one.startswith("AGI")) == "AGI"


async def test_provisioning_again_finds_nothing_to_do(site: Site) -> None:
    await site.provision("AGI", "AGII")
    assert await site.provision("AGI", "AGII") == Provisioned()


async def test_a_device_that_drifted_is_made_anew(site: Site) -> None:
    await site.provision("AGI")
    await site.agent.delete_device("AGI_odom")
    await site.agent.create_device(
        {"device_id": "AGI_odom", "apikey": "iveg", "entity_name": "OTHER"}
    )
    mended = (await site.provision("AGI")).mended
    assert mended == ("Made anew device AGI_odom.", "Made anew device AGI.")
    assert (await site.provision("AGI")).mended == ()


async def test_an_agent_that_forgot_our_devices_leaves_no_entities_of_its_own(
    site: Site,
) -> None:
    await site.provision("AGI")
    for device in names.ROBOT_DEVICES:
        await site.agent.delete_device("AGI" + device.suffix)
    site.up.agent.hear("/iveg/AGI_odom/attrs", b'{"base_pose_ground_truth":{}}')

    assert await site.orion.find_entities(["Robot:AGI_odom"]) == []
    assert "AGI_odom" not in str(await site.agent.read_devices())


async def test_entities_that_an_agent_once_made_up_are_removed(site: Site) -> None:
    group = {"apikey": "iveg", "resource": "/iot/json", "entity_type": "Robot"}
    await site.agent.create_group({**group, "cbroker": site.up.orion_url})
    for device in ("AGI_odom", "iveg-doctor", "somebody"):
        site.up.agent.hear(f"/iveg/{device}/attrs", b'{"v":1}')
    made_up = ["Robot:AGI_odom", "Robot:iveg-doctor", "Robot:somebody"]
    assert len(await site.orion.find_entities(made_up)) == 3

    mended = (await site.provision("AGI")).mended

    assert await site.orion.find_entities(made_up) == [("Robot:somebody", "Robot")]
    assert "Removed entity Robot:AGI_odom, which no device of ours feeds." in mended
    assert "iveg-doctor" not in str(await site.agent.read_devices())
    assert (await site.provision("AGI")).mended == ()


async def test_a_doctor_at_work_keeps_its_device_and_its_entity(site: Site) -> None:
    device = {"device_id": "iveg-doctor", "entity_name": "iveg-doctor"}
    await site.agent.create_device({**device, "entity_type": "Probe", "apikey": "iveg"})
    site.up.agent.hear("/iveg/iveg-doctor/attrs", b'{"probe":1}')

    await site.provision("AGI")
    kept = await site.orion.find_entities(["iveg-doctor"])
    await site.agent.delete_device("iveg-doctor")
    await site.provision("AGI")

    assert kept == [("iveg-doctor", "Probe")]
    assert await site.orion.find_entities(["iveg-doctor"]) == []


async def test_a_command_that_was_never_registered_gets_its_road(site: Site) -> None:
    await site.provision("AGI")
    (registration,) = await site.orion.read_registrations()
    await site.orion.delete_registration(registration["id"])
    assert (await site.provision("AGI")).mended == ("Made anew device AGI.",)
    assert await site.command_arrives("AGI")


async def test_a_shadow_of_the_command_at_orion_is_deleted(site: Site) -> None:
    await site.provision("AGI")
    body = {"id": "AGI", "type": "Robot", "cmd": {"type": "command", "value": ""}}
    await site.orion.ask("POST", "/v2/entities", query={"options": "upsert"}, body=body)
    assert not await site.command_arrives("AGI")
    (told,) = (await site.provision("AGI")).mended
    assert told.startswith("Deleted attribute cmd of AGI")
    assert await site.command_arrives("AGI")


async def test_a_shadow_of_the_goal_at_orion_is_deleted_too(site: Site) -> None:
    await site.provision("AGI")
    body = {"id": "AGI", "type": "Robot", "goal": {"type": "command", "value": ""}}
    await site.orion.ask("POST", "/v2/entities", query={"options": "upsert"}, body=body)
    (told,) = (await site.provision("AGI")).mended
    assert told.startswith("Deleted attribute goal of AGI")


async def test_a_device_of_an_earlier_version_gets_its_second_command(
    site: Site,
) -> None:
    await site.provision("AGI")
    devices = {one["device_id"]: one for one in await site.agent.read_devices()}
    only_cmd = {**devices["AGI"], "commands": devices["AGI"]["commands"][:1]}
    await site.agent.delete_device("AGI")
    await site.agent.create_device(only_cmd)

    assert (await site.provision("AGI")).mended == ("Made anew device AGI.",)
    assert await site.command_arrives("AGI")


async def test_registrations_of_an_agent_that_forgot_are_cleared(site: Site) -> None:
    await site.provision("AGI")
    stale = {
        "dataProvided": {
            "entities": [{"id": "AGI", "type": "Robot"}],
            "attrs": ["cmd"],
        },
        "provider": {"http": {"url": "http://127.0.0.1:1"}},
    }
    await site.agent.delete_device("AGI")
    await site.orion.ask("POST", "/v2/registrations", body=stale)
    mended = (await site.provision("AGI")).mended
    assert "Removed an old registration of the command of AGI." in mended
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
    await site.agent.create_device(gps)
    told = await site.provision("AGI")
    assert told.mended == ()
    assert told.problems[0].startswith("Device AAA_gps also feeds AGI")


async def test_climate_and_heartbeat_reach_their_entities(site: Site) -> None:
    await site.provision("AGI")
    async with aiomqtt.Client("127.0.0.1", site.up.mqtt_port) as mqtt:
        await mqtt.publish("/iveg/climate/attrs", b'{"temperature": 21.5}', qos=1)
        await mqtt.publish("/iveg/iveg-canary/attrs", b'{"probe": {"seq": 1}}', qos=1)
    probes = await read_soon(site.orion, names.HEARTBEAT_TYPE, "probe")
    climates = await site.orion.read_entities(names.CLIMATE_TYPE, ["temperature"])
    assert [one["id"] for one in probes] == [names.HEARTBEAT_ID]
    assert [one["temperature"]["value"] for one in climates] == [21.5]


async def test_an_agent_that_is_away_is_a_hop_error() -> None:
    async with IotAgentClient("http://127.0.0.1:1", *TENANT) as agent:
        with pytest.raises(HopError, match=r"^iot_agent: cannot be reached"):
            await agent.version()
