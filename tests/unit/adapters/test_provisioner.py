"""The chain is made whole, and mended, with no hand on it."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable

import orjson
import pytest

from iveg.adapters import clock
from iveg.adapters.fiware_http import Document
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.adapters.orion import OrionClient
from iveg.adapters.provisioner import Provisioner
from iveg.adapters.reconciler import FiwareSite, ensure_subscriptions, wanted_for
from iveg.domain.observations import Odometry, Origin, Received
from iveg.domain.world import World
from iveg.lab.embedded.server import Running, embedded_fiware
from iveg.ngsi import codec, names
from iveg.vital.health_monitor import HealthMonitor
from iveg.vital.ingest import Ingest
from tests.builders import ignore, odometry
from tests.http_servers import Request, Response, http_server
from tests.patience import until

SERVICE = ("agroconnect", "/greenhouse")


async def first_ids(site: "Place") -> frozenset[str]:
    await until(lambda: site.own.ids)
    return site.own.ids


class HastyOrion(OrionClient):
    """Notifies of each subscription before it says its id."""

    def __init__(self, url: str) -> None:
        super().__init__(url, *SERVICE)
        self.notify: Callable[[str], object] = bool
        self.taken: list[object] = []

    async def create_subscription(self, document: Document) -> str:
        made = await super().create_subscription(document)
        self.taken.append(self.notify(made))
        return made


class Place:
    """Provisioner over a FIWARE that can be reached, or cannot."""

    def __init__(
        self,
        fiware: Running,
        *,
        orion_url: str = "",
        agent_url: str = "",
        orion: OrionClient | None = None,
    ) -> None:
        self.health_monitor = HealthMonitor(clock.now(), lambda: "ok")
        self.ingest = Ingest(World(("AGI",)), ignore, ignore)
        self.orion = orion or OrionClient(orion_url or fiware.orion_url, *SERVICE)
        self.agent = IotAgentClient(agent_url or fiware.iota_url, *SERVICE)
        self.link = MqttLink(
            BrokerAddress("127.0.0.1", fiware.mqtt_port),
            "test",
            {names.measure_topic("iveg", names.HEARTBEAT_ID): 0},
            ignore,
        )
        self.provisioner = Provisioner(
            self.orion,
            self.agent,
            self.link,
            self.health_monitor,
            self.ingest,
            FiwareSite(
                ["AGI"],
                "iveg",
                context_broker_url=fiware.orion_url,
                notify_url="http://127.0.0.1:9/ngsi/notifications",
                notify_token="ab" * 32,
                boot="boot",
            ),
        )
        self.own = self.provisioner.subscriptions

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator["Place"]:
        parts = self.link, self.provisioner
        tasks = [asyncio.create_task(part.run()) for part in parts]
        try:
            yield self
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await self.orion.close()
            await self.agent.close()


@pytest.fixture
async def fiware() -> AsyncIterator[Running]:
    async with embedded_fiware() as running:
        yield running


async def test_a_subscription_is_ours_as_soon_as_orion_uses_it(
    fiware: Running,
) -> None:
    orion = HastyOrion(fiware.orion_url)
    site = Place(fiware, orion=orion)
    orion.notify = site.own.is_ours
    assert site.own.is_ours("of an earlier run, until the first are known")
    async with site.running():
        ids = await first_ids(site)

    assert orion.taken == [True] * len(wanted_for())
    assert site.own.is_ours(next(iter(ids)))
    assert not site.own.is_ours("somebody else's")


async def test_the_secret_of_an_earlier_start_is_known_and_no_other(
    fiware: Running,
) -> None:
    async with OrionClient(fiware.orion_url, *SERVICE) as orion:
        url = "http://127.0.0.1:9/ngsi/notifications"
        await ensure_subscriptions(orion, url, "cd" * 32, wanted_for())
    site = Place(fiware)
    assert site.own.is_former("any, before Orion has said which are ours")
    async with site.running():
        await first_ids(site)

    assert site.own.is_former("cd" * 32)
    assert not site.own.is_former("ef" * 32)


async def test_what_a_gap_has_lost_is_read_once_and_never_looks_live(
    fiware: Running,
) -> None:
    async with Place(fiware).running() as site:
        await until(lambda: site.own.ids)
        measure = codec.write_measure(odometry())
        await site.link.publish("/iveg/AGI_odom/attrs", measure)
        read: list[Received] = []
        async with asyncio.timeout(30):
            while not read:
                await site.ingest.wait(0.1)
                drained = site.ingest.drain()
                read = [one for one in drained if isinstance(one.observation, Odometry)]

    assert all(one.is_query_answer for one in read)
    assert {one.transport for one in read} == {"fiware"}


async def test_an_agent_that_falls_behind_is_asked_nothing_more(
    fiware: Running,
) -> None:
    asked: list[str] = []

    async def answer(request: Request) -> Response:
        asked.append(request.path)
        return Response(200, b"{}")

    async with http_server(answer, "127.0.0.1", 0) as port:
        behind = Place(fiware, agent_url=f"http://127.0.0.1:{port}")
        now = clock.now()
        for seq, (left, back) in enumerate(((-14.0, -12.0), (-8.0, 0.0))):
            behind.health_monitor.probe.sent(Origin("b", seq), now.later(left))
            behind.health_monitor.received(Origin("b", seq), now.later(back))
        behind.health_monitor.received_at = now.mono
        async with behind.running() as site:
            await first_ids(site)

    assert set(asked) == {"/iot/about"}


@pytest.mark.parametrize(
    "body",
    [
        [{"id": 5, "description": "iVeg: odometry", "notification": 7}],
        "text",
    ],
)
async def test_json_that_nobody_can_use_is_orions_fault_and_kills_nothing(
    fiware: Running, body: object
) -> None:
    async def answer(request: Request) -> Response:
        # Alive by its probe, malformed in all other answers.
        known = request.path.startswith("/v2/entities/")
        return Response(404 if known else 200, b"{}" if known else orjson.dumps(body))

    async with http_server(answer, "127.0.0.1", 0) as port:
        malformed = Place(fiware, orion_url=f"http://127.0.0.1:{port}")
        async with malformed.running() as site:
            await until(lambda: site.health_monitor.notify_error)

    told = site.health_monitor.notify_error
    assert told == "answered something that means nothing here"
