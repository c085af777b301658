"""The embedded broker is held to MQTT 3.1.1, and to what its clients may cost."""

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import aiomqtt
import pytest

from iveg.lab.embedded import mqtt_broker as broker_module
from iveg.lab.embedded.mqtt_broker import MqttBroker, mqtt_broker, publish_packet


@pytest.fixture
async def broker() -> AsyncIterator[MqttBroker]:
    async with mqtt_broker("127.0.0.1", 0) as running:
        yield running


@pytest.fixture
async def robot(broker: MqttBroker) -> AsyncIterator[aiomqtt.Client]:
    async with aiomqtt.Client("127.0.0.1", broker.port) as client:
        yield client


@pytest.fixture
async def other(broker: MqttBroker) -> AsyncIterator[aiomqtt.Client]:
    async with aiomqtt.Client("127.0.0.1", broker.port) as client:
        yield client


async def heard(client: aiomqtt.Client) -> aiomqtt.Message:
    async with asyncio.timeout(30):
        return await anext(aiter(client.messages))


@pytest.mark.parametrize(
    "topic_filter", ["/iveg/AGI/cmd", "/iveg/+/cmd", "/iveg/#", "+/+/AGI/+", "#"]
)
async def test_a_filter_that_fits_hears(
    robot: aiomqtt.Client, other: aiomqtt.Client, topic_filter: str
) -> None:
    await robot.subscribe(topic_filter, qos=1)
    await other.publish("/iveg/AGI/cmd", b"x", qos=1)
    assert (await heard(robot)).payload == b"x"


async def test_a_retained_level_waits_for_whoever_comes_and_can_be_cleared(
    robot: aiomqtt.Client, other: aiomqtt.Client
) -> None:
    await other.publish("/AGI/iveg/desired", b"stopped", qos=1, retain=True)
    await robot.subscribe("/AGI/iveg/desired", qos=1)
    message = await heard(robot)
    assert (message.payload, message.retain) == (b"stopped", True)
    await other.publish("/AGI/iveg/desired", b"", qos=1, retain=True)
    await heard(robot)
    await robot.subscribe([("/AGI/iveg/desired", 1), ("end", 1)])
    await other.publish("end", b"end", qos=1)
    assert (await heard(robot)).payload == b"end"


async def test_a_neighbour_hears_and_publishes_without_a_connection(
    broker: MqttBroker, robot: aiomqtt.Client
) -> None:
    taken: list[tuple[str, bytes]] = []
    broker.listen(lambda topic, payload: taken.append((topic, payload)))
    await robot.subscribe("/iveg/AGI/cmd", qos=1)
    await robot.publish("/iveg/AGI/attrs", b"measure", qos=1)
    broker.publish("/iveg/AGI/cmd", b"order")
    message = await heard(robot)
    assert taken == [("/iveg/AGI/attrs", b"measure")]
    assert (message.payload, message.qos) == (b"order", 0)


async def test_a_neighbour_that_fails_hurts_no_client(
    broker: MqttBroker, robot: aiomqtt.Client, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(topic: str, payload: bytes) -> None:
        raise ValueError(topic, payload)

    broker.listen(fail)
    await robot.subscribe("a", qos=1)
    await robot.publish("a", b"x", qos=1)
    assert (await heard(robot)).payload == b"x"
    (told,) = [one for one in caplog.records if one.levelno >= logging.WARNING]
    assert told.getMessage() == "a message on a could not be taken"


CONNACK = b"\x20\x02\x00\x00"
PINGREQ, PINGRESP = b"\xc0\x00", b"\xd0\x00"


class Heard:
    """What a neighbour hears, in order."""

    def __init__(self, broker: MqttBroker) -> None:
        self.messages: list[tuple[str, bytes]] = []
        self._came = asyncio.Event()
        broker.listen(self._hear)

    def _hear(self, topic: str, payload: bytes) -> None:
        self.messages.append((topic, payload))
        self._came.set()

    async def wait_for(self, count: int) -> list[tuple[str, bytes]]:
        async with asyncio.timeout(30):
            while len(self.messages) < count:
                self._came.clear()
                await self._came.wait()
        return self.messages


@asynccontextmanager
async def line(
    broker: MqttBroker,
) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """A client that has said CONNECT and nothing else."""
    reader, writer = await asyncio.open_connection("127.0.0.1", broker.port)
    writer.write(b"\x10\x0e\x00\x04MQTT\x04\x02\x00\x00\x00\x02me")
    assert await reader.readexactly(4) == CONNACK
    try:
        yield reader, writer
    finally:
        writer.close()
        await writer.wait_closed()


async def answered(reader: asyncio.StreamReader, count: int) -> bytes:
    """The next bytes; none where the broker hung up."""
    async with asyncio.timeout(30):
        try:
            return await reader.readexactly(count)
        except (asyncio.IncompleteReadError, ConnectionError):
            return b""


@pytest.mark.parametrize("step", [1, 2, 3, 7])
async def test_packets_that_come_in_pieces_or_together_are_the_same(
    broker: MqttBroker, step: int
) -> None:
    heard = Heard(broker)
    sent = [("a", b"1"), ("b", b""), ("é", b"2" * 200), ("c", b"3")]
    stream = PINGREQ.join(publish_packet(*one) for one in sent)
    async with line(broker) as (reader, writer):
        for start in range(0, len(stream), step):
            writer.write(stream[start : start + step])
            await writer.drain()
        assert await heard.wait_for(len(sent)) == sent
        assert await answered(reader, 6) == 3 * PINGRESP


async def test_who_has_not_said_connect_publishes_nothing(broker: MqttBroker) -> None:
    heard = Heard(broker)
    _, stranger = await asyncio.open_connection("127.0.0.1", broker.port)
    stranger.write(publish_packet("stranger", b"x" * 40) * 3)
    await stranger.drain()
    async with line(broker) as (_, writer):
        writer.write(publish_packet("other", b""))
        assert await heard.wait_for(1) == [("other", b"")]
    stranger.close()
    await stranger.wait_closed()


async def test_a_slow_listener_misses_telemetry_and_costs_no_memory(
    broker: MqttBroker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(broker_module, "MOST_UNSENT", 100_000)
    subscribe = b"\x82\x06\x00\x01\x00\x01n\x00"
    async with (
        line(broker) as (deaf, writer),
        aiomqtt.Client("127.0.0.1", broker.port) as quick,
    ):
        writer.write(subscribe)
        assert await deaf.readexactly(5) == b"\x90\x03\x00\x01\x00"
        deaf._transport.pause_reading()  # type: ignore[attr-defined]
        await quick.subscribe("n", qos=0)
        messages = aiter(quick.messages)
        for number in range(200):
            await quick.publish("n", b"%d " % number + b"x" * 100_000, qos=0)
            async with asyncio.timeout(30):
                message = await anext(messages)
            assert bytes(message.payload).startswith(b"%d " % number)
        waiting = [client.unsent for client in broker.clients.values()]
    assert max(waiting) <= 300_000


@pytest.mark.parametrize(
    "packet",
    [
        b"\x82\x01\x00",
        b"\x82\x05\x00\x01\x00\x09a",
        b"\x82\x04\x00\x01\x00\x01",
        b"\x30\x02\x00\x05",
        b"\x34\x06\x00\x01a\x00\x01x",
        b"\x10\x02\x00\x04",
        b"\x30\xff\xff\xff\xff",
        b"\xf0\x00",
        b"\xa2\x05\x00\x01\x00\x01a",
    ],
)
async def test_a_packet_that_cannot_be_read_is_the_end_of_the_line(
    broker: MqttBroker, packet: bytes
) -> None:
    async with line(broker) as (reader, writer):
        writer.write(packet + PINGREQ)
        assert await answered(reader, 2) == b""


async def test_the_newest_client_of_an_identifier_stays(broker: MqttBroker) -> None:
    async with line(broker) as (first, _), line(broker) as (second, writer):
        assert await answered(first, 1) == b""
        writer.write(PINGREQ)
        assert await answered(second, 2) == PINGRESP
