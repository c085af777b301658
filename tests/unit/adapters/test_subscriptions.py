import asyncio
from collections.abc import Mapping
from typing import Any

import aiomqtt
import orjson
import pytest

from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.orion import SUBSCRIPTIONS, OrionClient
from iveg.adapters.reconciler import (
    PREFIX,
    TOKEN_HEADER,
    FiwareSite,
    ensure_subscriptions,
    provision,
    wanted_for,
)
from iveg.lab.embedded.server import embedded_fiware
from iveg.ngsi import codec, names
from tests.builders import odometry, safety_report, scan
from tests.http_servers import Request, Response, http_server

URL = "http://127.0.0.1:8000/ngsi/notifications"
TOKEN = "ab" * 16
WANTED = wanted_for()


class FakeStore(OrionClient):
    """Subscriptions as Orion would keep them, in a list."""

    def __init__(self) -> None:
        self.kept: dict[str, dict[str, Any]] = {}
        self.calls = 0

    async def read_all(self, *_: object, **__: object) -> list[dict[str, Any]]:
        return [{"id": key, **one} for key, one in self.kept.items()]

    async def create_subscription(self, document: Mapping[str, Any]) -> str:
        self.calls += 1
        subscription_id = f"{self.calls:024x}"
        self.kept[subscription_id] = {"status": "active", **document}
        return subscription_id

    async def ask(self, method: str, path: str, body: Any = None, **_: object) -> Any:
        assert method == "PATCH"
        self.calls += 1
        self.kept[path.removeprefix(f"{SUBSCRIPTIONS}/")].update(body)

    async def delete(self, path: str, *_: object, **__: object) -> None:
        self.calls += 1
        del self.kept[path.removeprefix(f"{SUBSCRIPTIONS}/")]

    def named(self, name: str) -> dict[str, Any]:
        return next(
            one for one in self.kept.values() if one["description"] == PREFIX + name
        )


async def test_twenty_restarts_make_no_second_one_and_change_nothing() -> None:
    async with (
        embedded_fiware() as up,
        OrionClient(up.orion_url, "agroconnect", "/greenhouse") as orion,
    ):
        first = await ensure_subscriptions(orion, URL, TOKEN, WANTED)
        for _ in range(20):
            again = await ensure_subscriptions(orion, URL, TOKEN, WANTED)
            assert again.ids == first.ids
            assert again.mended == ()
        assert len(await orion.read_all(SUBSCRIPTIONS)) == len(WANTED)


async def test_what_orion_is_told_is_what_it_needs() -> None:
    store = FakeStore()
    await ensure_subscriptions(store, URL, TOKEN, WANTED)
    lidar = store.named("lidar")
    assert lidar["subject"] == {
        "entities": [{"idPattern": ".*", "type": "Robot"}],
        "condition": {"attrs": ["lidar_points", "lidar_header"]},
    }
    assert lidar["notification"] == {
        "httpCustom": {"url": URL, "headers": {TOKEN_HEADER: TOKEN}, "timeout": 2000},
        "attrs": ["lidar_points", "lidar_header"],
        "attrsFormat": "normalized",
    }
    assert store.named("single uplink")["subject"]["condition"] == {
        "attrs": ["timestamp", "pose", "class"]
    }


@pytest.mark.parametrize(
    "damage",
    [
        {"subject": {"entities": [{"id": "AGI"}], "condition": {"attrs": []}}},
        {"notification": {"http": {"url": URL}, "attrs": []}},
        {"throttling": 1},
        {"expires": "2027-01-01T00:00:00.000Z"},
    ],
)
async def test_a_damaged_subscription_is_made_right(damage: dict[str, Any]) -> None:
    store = FakeStore()
    await ensure_subscriptions(store, URL, TOKEN, WANTED)
    wanted = dict(store.named("odometry"))
    store.named("odometry").update(damage)
    mended = await ensure_subscriptions(store, URL, TOKEN, WANTED)
    assert len(mended.mended) == 1
    assert store.named("odometry") == wanted
    assert (await ensure_subscriptions(store, URL, TOKEN, WANTED)).mended == ()


async def test_a_new_address_or_secret_reaches_every_subscription() -> None:
    store = FakeStore()
    first = await ensure_subscriptions(store, URL, TOKEN, WANTED)
    for url, token in ((URL + "2", TOKEN), (URL + "2", "cd" * 16)):
        again = await ensure_subscriptions(store, url, token, WANTED)
        assert again.ids == first.ids
        assert len(again.mended) == len(WANTED)


async def test_doubles_and_leftovers_of_ours_go_and_others_stay() -> None:
    store = FakeStore()
    await ensure_subscriptions(store, URL, TOKEN, WANTED)
    await store.create_subscription(store.named("odometry"))
    await store.create_subscription({"description": PREFIX + "odometry AGI"})
    theirs = await store.create_subscription({"description": "somebody else's"})
    ensured = await ensure_subscriptions(store, URL, TOKEN, WANTED)
    assert len(ensured.mended) == 2
    assert frozenset(store.kept) == ensured.ids | {theirs}


POSE = codec.write_measure(odometry())
BOTH = orjson.dumps(
    orjson.loads(POSE) | orjson.loads(codec.write_measure(safety_report()))
)
SINGLE = orjson.dumps({"pose": {"x": 1, "y": 2, "yaw": 0}, "timestamp": "t"})


@pytest.mark.parametrize(
    ("topic", "payload", "told"),
    [
        ("/iveg/AGI_lidar2D/attrs", codec.write_measure(scan()), ["lidar"]),
        ("/iveg/AGI/attrs", SINGLE, ["single uplink"]),
        ("/iveg/AGI/cmdexe", b'{"goal": {"id": "01G", "r": "REACHED"}}', ["goals"]),
        ("/iveg/AGI/attrs", BOTH, ["odometry", "safety"]),
    ],
    ids=["scan", "single", "goal", "two at once"],
)
async def test_an_update_is_one_request_for_each_subscription_that_is_about_it(
    topic: str, payload: bytes, told: list[str]
) -> None:
    heard = asyncio.Event()

    async def take(request: Request) -> Response:
        if names.CLIMATE_ID.encode() in request.body:
            heard.set()
        return Response(204)

    async with (
        embedded_fiware() as up,
        OrionClient(up.orion_url, "agroconnect", "/greenhouse") as orion,
        IotAgentClient(up.iota_url, "agroconnect", "/greenhouse") as agent,
        http_server(take, "127.0.0.1", 0) as port,
        aiomqtt.Client("127.0.0.1", up.mqtt_port) as mqtt,
    ):
        await provision(agent, orion, FiwareSite(["AGI"], "iveg", up.orion_url))
        here = f"http://127.0.0.1:{port}/ngsi/notifications"
        await ensure_subscriptions(orion, here, TOKEN, WANTED)
        await mqtt.publish(topic, payload, qos=1)
        # The agent and Orion take this one after it, and are done with it by then.
        await mqtt.publish("/iveg/climate/attrs", b'{"temperature": 21}', qos=1)
        async with asyncio.timeout(30):
            await heard.wait()
        kept = await orion.read_all(SUBSCRIPTIONS)

    sent = {
        one["description"].removeprefix(PREFIX): one["notification"]["timesSent"]
        for one in kept
        if "timesSent" in one["notification"]
    }
    assert sent == dict.fromkeys([*told, "climate"], 1)
