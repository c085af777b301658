import logging
from collections.abc import AsyncIterator

import aiomqtt
import pytest

from iveg.adapters.iot_agent import DEVICES, IotAgentClient
from iveg.adapters.orion import OrionClient
from iveg.adapters.reconciler import FiwareSite, provision
from iveg.domain.errors import HopError
from iveg.lab.embedded.context_broker import Registration
from iveg.lab.embedded.entities import new_id
from iveg.lab.embedded.server import Running, embedded_fiware

TENANT = ("agroconnect", "/greenhouse")

POISON = [
    b"[" * 8000,
    b"[" * 900 + b"]" * 900,
    b'{"a":' * 900 + b"1" + b"}" * 900,
    b'{"a":' + b"[" * 300 + b'"<"' + b"]" * 300 + b"}",
    b'{"hasOwnProperty":1}',
    b'{"__proto__":{"a":1}}',
    b"\xff\xfe",
    b"null",
]


@pytest.fixture
async def up() -> AsyncIterator[Running]:
    async with embedded_fiware() as running:
        yield running


@pytest.fixture
async def orion(up: Running) -> AsyncIterator[OrionClient]:
    async with (
        OrionClient(up.orion_url, *TENANT) as orion,
        IotAgentClient(up.iota_url, *TENANT) as agent,
    ):
        await provision(agent, orion, FiwareSite(["AGI"], "iveg", up.orion_url))
        yield orion


@pytest.mark.parametrize("topic", ["/iveg/AGI/attrs", "/iveg/AGI/cmdexe"])
@pytest.mark.parametrize("payload", POISON, ids=range(len(POISON)))
async def test_poison_is_survived_in_silence(
    up: Running,
    orion: OrionClient,
    topic: str,
    payload: bytes,
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with aiomqtt.Client("127.0.0.1", up.mqtt_port) as mqtt:
        await mqtt.publish(topic, payload, qos=1)
        await mqtt.publish("/iveg/AGI/attrs", b'{"alive":1}', qos=1)
        await mqtt.publish("/iveg/AGI/attrs", b'{"alive":2}', qos=1)
    (robot,) = await orion.read_all(
        "/v2/entities", {"attrs": "alive", "options": "count"}
    )
    assert robot["alive"]["value"] in (1, 2)
    assert not [one for one in caplog.records if one.levelno >= logging.WARNING]


@pytest.mark.parametrize(
    "part",
    [
        {"attributes": [1]},
        {"commands": "x"},
        {"device_id": 5},
        {"static_attributes": [{"name": "maker", "value": "us"}]},
        {"lazy": [{"name": "color"}]},
    ],
)
async def test_a_device_of_another_shape_or_with_what_is_not_supported_is_refused(
    up: Running, part: dict[str, object]
) -> None:
    entity = {"entity_name": "AGI", "entity_type": "Robot"}
    async with IotAgentClient(up.iota_url, *TENANT) as agent:
        device = {"device_id": "D", "apikey": "iveg", **entity, **part}
        with pytest.raises(HopError, match="400"):
            await agent.create(DEVICES, {"devices": [device]})


async def test_a_command_of_a_device_that_the_agent_lost_is_404(
    up: Running, orion: OrionClient
) -> None:
    known = new_id(), TENANT[1], "OLD", "Robot", ("cmd",)
    stale = Registration(*known, "http://gone", up.agent.command)
    up.broker.tenant(TENANT[0]).registrations[stale.id] = stale
    with pytest.raises(HopError, match="404"):
        await orion.update_command("OLD", {"stop": {}})


async def test_a_device_is_of_the_tenant_of_the_request_whatever_it_says(
    up: Running,
) -> None:
    device = {
        "device_id": "D",
        "apikey": "iveg",
        "service": "other",
        "entity_name": "AGI",
        "entity_type": "Robot",
    }
    async with IotAgentClient(up.iota_url, *TENANT) as agent:
        await agent.create(DEVICES, {"devices": [device]})
        (made,) = await agent.read_all(DEVICES, part="devices")
    assert (made["service"], made["service_path"]) == TENANT
