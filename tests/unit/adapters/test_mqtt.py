"""One connection that comes back by itself, against a real broker."""

import asyncio
import contextlib
from collections.abc import AsyncIterator

import orjson
import pytest

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.adapters.transports import MqttTransport
from iveg.domain.errors import HopError
from iveg.lab.embedded.mqtt_broker import mqtt_broker
from tests.patience import until
from tests.ports import free_ports

CONNACK = b"\x20\x02\x00\x00"


@contextlib.asynccontextmanager
async def running(*links: MqttLink) -> AsyncIterator[None]:
    tasks = [asyncio.create_task(link.run()) for link in links]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class Heard:
    """A link that keeps what it hears."""

    def __init__(self, port: int, *topics: str) -> None:
        self.messages: list[tuple[str, bytes]] = []
        self.link = MqttLink(BrokerAddress("127.0.0.1", port), "test")
        self.link.attach(
            dict.fromkeys(topics, 1),
            lambda topic, payload: self.messages.append((topic, payload)),
        )


@contextlib.asynccontextmanager
async def broker_that_confirms_nothing(
    heard: bytearray, reads: asyncio.Event
) -> AsyncIterator[MqttLink]:
    """A link to one that keeps what it reads, from when it may."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.read(64)
        writer.write(CONNACK)
        await reads.wait()
        while more := await reader.read(2**20):
            heard.extend(more)
        writer.close()

    async with await asyncio.start_server(serve, "127.0.0.1", 0, limit=1024) as server:
        port = server.sockets[0].getsockname()[1]
        yield MqttLink(BrokerAddress("127.0.0.1", port), "test")


# --- addresses --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("url", "address"),
    [
        ("mqtt://broker:1884", BrokerAddress("broker", 1884)),
        ("mqtt://broker", BrokerAddress("broker", 1883)),
        ("mqtts://broker", BrokerAddress("broker", 8883, tls=True)),
        ("mqtt://a:b%40c@broker", BrokerAddress("broker", 1883, "a", "b@c")),
        ("mqtt://[::1]:1883", BrokerAddress("::1", 1883)),
    ],
)
def test_an_address_is_read_from_its_url(url: str, address: BrokerAddress) -> None:
    assert BrokerAddress.from_url(url) == address


# --- a connection -----------------------------------------------------------------


async def test_of_what_is_offered_while_away_the_newest_of_each_topic_arrives() -> None:
    async with mqtt_broker("127.0.0.1", 0) as broker:
        port = broker.port
        heard = Heard(port, "/a", "/b")
        for number in range(10):
            heard.link.enqueue("/a", str(number).encode())
        heard.link.enqueue("/b", b"b")
        async with running(heard.link):
            await until(lambda: len(heard.messages) == 2)

    assert sorted(heard.messages) == [("/a", b"9"), ("/b", b"b")]
    assert heard.link.replaced == 9


async def test_connections_apart_come_and_go_together() -> None:
    heard, changes, (port,) = list[str](), list[bool](), free_ports(1)
    link = MqttLink(BrokerAddress("127.0.0.1", port), "test")
    apart = [{f"/{number}": 0} for number in range(5)]
    link.attach({}, lambda topic, _: heard.append(topic), changes.append, apart=apart)
    async with running(link):
        async with mqtt_broker("127.0.0.1", port):
            await until(lambda: link.connected)
            for number in range(5):
                link.enqueue(f"/{number}", b"")
            await until(lambda: len(heard) == 5)
        await until(lambda: changes == [True, False])


async def test_an_order_waits_for_no_confirmation_of_telemetry() -> None:
    said, reads = bytearray(), asyncio.Event()
    reads.set()
    async with broker_that_confirms_nothing(said, reads) as link:
        for number in range(100):
            link.enqueue(f"telemetry/{number}", b"", qos=1)
        async with running(link):
            await until(lambda: link.connected)
            order = asyncio.create_task(link.publish("cmd", b"stop"))
            await until(lambda: b"stop" in said)
            order.cancel()


async def test_while_the_socket_is_full_only_the_newest_of_a_topic_waits() -> None:
    heard, reads = bytearray(), asyncio.Event()
    async with broker_that_confirms_nothing(heard, reads) as link, running(link):
        await until(lambda: link.connected)

        link.enqueue("/large", bytes(16 * 2**20))
        await asyncio.sleep(0)  # the sender takes it, and finds no room for all of it
        await asyncio.sleep(0)
        for number in range(5):
            link.enqueue("/small", b"number %d" % number)
            await asyncio.sleep(0)
        reads.set()
        await until(lambda: b"number 4" in heard)

    assert len(heard) > 16 * 2**20
    assert heard.count(b"number") == 1
    assert link.replaced == 4


async def test_publishing_while_away_fails_loudly() -> None:
    link = Heard(free_ports(1)[0]).link

    with pytest.raises(HopError, match="not connected"):
        await link.publish("/a", b"1")


@pytest.mark.parametrize("qos", [0, 1])
async def test_a_mistake_of_who_listens_ends_the_link_and_not_its_connection_alone(
    qos: int,
) -> None:
    def mistake(topic: str, _: bytes) -> None:
        raise LookupError(topic)

    async with mqtt_broker("127.0.0.1", 0) as broker:
        sender = Heard(broker.port)
        link = MqttLink(
            BrokerAddress("127.0.0.1", broker.port), "test", {"t": qos}, mistake
        )
        async with running(sender.link):
            ending = asyncio.create_task(link.run())
            await until(lambda: sender.link.connected and link.connected)
            await sender.link.publish("t", b"x", qos)
            with pytest.raises(LookupError):
                async with asyncio.timeout(20.0):
                    await ending


# --- the direct transport ---------------------------------------------------------


async def test_a_robot_that_reconnects_finds_the_level_and_no_old_command() -> None:
    async with mqtt_broker("127.0.0.1", 0) as broker:
        port = broker.port
        iveg = Heard(port)
        transport = MqttTransport(iveg.link, "iveg")
        async with running(iveg.link):
            await until(lambda: iveg.link.connected)
            await transport.set_desired_state("AGI", "stopped", ["01A"])
            await transport.stop("AGI", "01A", "x")
            robot = Heard(port, "/iveg/AGI/cmd", "/AGI/iveg/desired")
            async with running(robot.link):
                await until(lambda: robot.messages)
                await iveg.link.publish("/iveg/AGI/cmd", b"last")
                await until(lambda: robot.messages[-1][1] == b"last")

    assert [topic for topic, _ in robot.messages] == [
        "/AGI/iveg/desired",
        "/iveg/AGI/cmd",
    ]


@pytest.mark.parametrize("qos", [0, 1])
async def test_what_the_broker_had_retained_is_told_apart_from_news(qos: int) -> None:
    stored: list[tuple[str, bytes]] = []
    async with mqtt_broker("127.0.0.1", 0) as broker:
        sender, reader = Heard(broker.port), Heard(broker.port)
        reader.link.attach(
            {"t": qos},
            lambda topic, payload: reader.messages.append((topic, payload)),
            on_stored=lambda topic, payload: stored.append((topic, payload)),
        )
        async with running(sender.link):
            await until(lambda: sender.link.connected)
            await sender.link.publish("t", b"old", retain=True)
            async with running(reader.link):
                await until(lambda: reader.link.connected and stored)
                await sender.link.publish("t", b"new", retain=True)
                await until(lambda: reader.messages)

    assert (stored, reader.messages) == ([("t", b"old")], [("t", b"new")])


async def test_a_release_and_a_resume_are_published_once_at_qos_0_and_not_kept() -> (
    None
):
    sent: list[tuple[str, bytes, int, bool]] = []

    class Written(MqttLink):
        async def publish(
            self, topic: str, payload: bytes, qos: int = 1, *, retain: bool = False
        ) -> None:
            sent.append((topic, payload, qos, retain))

    transport = MqttTransport(Written(BrokerAddress("127.0.0.1", 1), "iveg"), "iveg")
    await transport.release("AGI", ["01A", "boot-1"], "c", "01T")
    await transport.resume("AGI", "d", "01U")

    assert [(topic, qos, retain) for topic, _, qos, retain in sent] == [
        ("/iveg/AGI/cmd", 0, False)
    ] * 2
    assert [orjson.loads(payload)["cmd"] for _, payload, _, _ in sent] == [
        {"release": {"ids": ["01A", "boot-1"], "ch": "c", "attempt": "01T"}},
        {"resume": {"ch": "d", "attempt": "01U"}},
    ]
