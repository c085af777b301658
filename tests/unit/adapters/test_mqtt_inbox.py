"""How MQTT is read: in large pieces, and of what waits only the newest."""

import asyncio
import contextlib
import inspect
import itertools
import socket
import struct
import threading
from collections.abc import Callable, Iterator

import aiomqtt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion

from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.mqtt import MOST_EARLY, MqttLink
from iveg.adapters.mqtt_inbox import (
    Arrived,
    InboxClient,
    Qos1Message,
    ReadAhead,
    sort_packets,
)
from iveg.adapters.mqtt_packets import publish_packet

MANY = 300
CONNACK = b"\x20\x02\x00\x00"
PONG = b"\xd0\x00"


@pytest.fixture
def line() -> Iterator[tuple[socket.socket, ReadAhead]]:
    far, near = socket.socketpair()
    with far, near:
        near.setblocking(False)
        yield far, ReadAhead(near, lambda *_: None)


def test_an_event_takes_from_the_wire_once_however_much_there_is(
    line: tuple[socket.socket, ReadAhead],
) -> None:
    far, near = line
    far.sendall(2 * PONG)
    assert near.read_ahead()
    assert near.recv(1) == PONG[:1]
    far.sendall(PONG)
    assert near.pending()
    assert near.recv(9) == PONG[1:] + PONG
    assert not near.pending()
    with pytest.raises(BlockingIOError):
        near.recv(1)
    assert near.read_ahead()
    assert near.recv(9) == PONG
    assert not near.read_ahead()


def test_an_end_of_the_line_is_an_end(line: tuple[socket.socket, ReadAhead]) -> None:
    far, near = line
    far.sendall(PONG)
    far.close()
    assert near.read_ahead()
    assert near.recv(9) == PONG
    assert not near.pending()
    assert near.read_ahead()
    assert near.pending()
    assert near.recv(9) == b""


def test_a_line_that_was_reset_has_ended() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        here = socket.create_connection(server.getsockname())
        there, _ = server.accept()
    there.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    there.close()
    with here:
        near = ReadAhead(here, lambda *_: None)
        assert near.read_ahead()
        assert near.recv(9) == b""


@contextlib.contextmanager
def talking(
    packets: bytes, early: bytes = b"", *, hangs_up: bool = False
) -> Iterator[int]:
    """A broker that admits one client and says everything at once.

    Args:
        packets: Said when the subscription stands; ``early`` before.
        hangs_up: As soon as it hears from the client again.
    """

    def serve() -> None:
        client, _ = server.accept()
        with client:
            client.recv(1000)
            client.sendall(CONNACK)
            subscribe = client.recv(1000)
            client.sendall(early)
            client.sendall(b"\x90\x03" + subscribe[2:4] + b"\x00" + packets)
            while client.recv(100_000) and not hangs_up:
                """Until it hangs up; it confirms what it was sent."""

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=serve, daemon=True).start()
        yield int(server.getsockname()[1])


async def test_a_busy_loop_reads_all_that_has_come_and_not_a_packet_a_turn() -> None:
    heard: list[str] = []
    packets = b"".join(publish_packet(f"t/{n}", b"x" * 300) for n in range(MANY))
    turns = 0
    with talking(packets) as port:
        link = MqttLink(
            BrokerAddress("127.0.0.1", port),
            "test",
            {"t/+": 0},
            lambda topic, _: heard.append(topic),
        )
        reading = asyncio.create_task(link.run())
        async with asyncio.timeout(20.0):
            while len(heard) < MANY:
                turns += bool(heard)
                await asyncio.sleep(0)
        reading.cancel()
        await asyncio.gather(reading, return_exceptions=True)

    assert heard == [f"t/{n}" for n in range(MANY)]
    assert turns < MANY / 3


async def test_of_what_came_before_the_subscriptions_stood_the_newest_are_kept() -> (
    None
):
    heard: list[int] = []
    early = (confirmed_packet("t", b"%d" % n) for n in range(MOST_EARLY + 500))
    with talking(b"", b"".join(early)) as port:
        link = MqttLink(
            BrokerAddress("127.0.0.1", port),
            "test",
            {"t": 1},
            lambda _, payload: heard.append(int(payload)),
        )
        reading = asyncio.create_task(link.run())
        async with asyncio.timeout(20.0):
            while not heard:  # noqa: ASYNC110 - no event
                await asyncio.sleep(0.005)
        reading.cancel()
        await asyncio.gather(reading, return_exceptions=True)

    assert heard == [*range(500, MOST_EARLY + 500)]


REST_S = 0.1


async def test_what_comes_during_a_rest_is_read_together_after_it() -> None:
    loop = asyncio.get_running_loop()
    heard = asyncio.Queue[tuple[str, float]]()

    def note(arrived: Arrived) -> None:
        for topic in arrived.telemetry:
            heard.put_nowait((topic, loop.time()))

    here, there = socket.socketpair()
    with here, there:
        here.setblocking(False)
        client = InboxClient("nowhere", on_arrived=note, apart_s=REST_S)
        line = client._client._sock = ReadAhead(here, note)
        client._listen(line)
        async with asyncio.timeout(20.0):
            there.sendall(publish_packet("first", b""))
            first, at = await heard.get()
            there.sendall(publish_packet("second", b""))
            await asyncio.sleep(0.1 * REST_S)
            there.sendall(publish_packet("third", b""))
            (second, then), (third, later) = await heard.get(), await heard.get()
            # Nothing comes during the next rest; then it waits for an event again.
            await asyncio.sleep(2.0 * REST_S)
            there.sendall(publish_packet("fourth", b""))
            fourth, _ = await heard.get()
        client._client._sock = None

    assert (first, second, third, fourth) == ("first", "second", "third", "fourth")
    assert then - at >= 0.9 * REST_S
    assert later - then < 0.5 * REST_S


async def test_a_line_that_ends_during_a_rest_is_lost_after_it() -> None:
    lost = asyncio.Event()
    with talking(publish_packet("t", b"x"), hangs_up=True) as port:
        link = MqttLink(
            BrokerAddress("127.0.0.1", port),
            "test",
            {"t": 0},
            # The broker hangs up as soon as it hears from us again.
            lambda *_: link.enqueue("bye", b""),
            on_loss=lost.set,
            apart_s=0.05,
        )
        running = asyncio.create_task(link.run())
        async with asyncio.timeout(20.0):
            await lost.wait()
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    assert link.connects == 1


async def test_a_message_before_the_subscriptions_is_acknowledged_and_waits() -> None:
    said: asyncio.Queue[bytes] = asyncio.Queue()

    async def broker(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        await reader.read(1000)
        writer.write(CONNACK)
        subscribe = await reader.read(1000)
        writer.write(confirmed_packet("t", b"order"))
        said.put_nowait(await reader.read(1000))
        writer.write(b"\x90\x03" + subscribe[2:4] + b"\x01")
        await reader.read(1000)
        writer.close()

    heard: asyncio.Queue[tuple[bytes, bool]] = asyncio.Queue()
    async with await asyncio.start_server(broker, "127.0.0.1", 0) as server:
        link = MqttLink(
            BrokerAddress("127.0.0.1", server.sockets[0].getsockname()[1]),
            "test",
            {"t": 1},
            lambda _, payload: heard.put_nowait((payload, link.connected)),
        )
        reading = asyncio.create_task(link.run())
        async with asyncio.timeout(20.0):
            assert await said.get() == b"\x40\x02\x00\x07"
            assert await heard.get() == (b"order", True)
        reading.cancel()
        await asyncio.gather(reading, return_exceptions=True)


def confirmed_packet(topic: str, payload: bytes) -> bytes:
    body = len(topic).to_bytes(2, "big") + topic.encode() + b"\x00\x07" + payload
    return b"\x32" + bytes((len(body),)) + body


def test_of_telemetry_that_has_come_the_newest_of_each_topic_is_read() -> None:
    came = b"".join(publish_packet(f"t/{n % 2}", b"%d" % n) for n in range(3000))

    newest = {"t/0": b"2998", "t/1": b"2999"}
    passed_over = {"t/0": 1499, "t/1": 1499}
    assert sort_packets(came) == (Arrived(newest, passed_over), b"")


def test_what_was_sent_at_qos_1_is_all_read_in_its_order() -> None:
    messages = [confirmed_packet("t", b"answer %d" % n) for n in range(3)]
    looks = [publish_packet("t", b"look %d" % n) for n in range(3)]
    came = b"".join(itertools.chain(*zip(looks, messages, strict=True)))

    arrived, _ = sort_packets(came)

    assert arrived.telemetry == {"t": b"look 2"}
    assert arrived.qos1 == [Qos1Message("t", b"answer %d" % n, 7) for n in range(3)]


def test_a_puback_is_read_and_what_is_no_message_is_left_to_the_library() -> None:
    arrived, begun = sort_packets(b"\x40\x02\x01\x07" + PONG + b"\x40\x02")

    assert arrived == Arrived(pubacks=[0x107], others=PONG)
    assert begun == b"\x40\x02"


MOVED = "docs/decisions/0005-past-the-mqtt-library.md: a private part has moved: "


async def test_the_private_parts_of_the_libraries_are_those_that_are_known() -> None:
    client = InboxClient("nowhere", on_arrived=lambda _: None)
    opened = list(inspect.signature(aiomqtt.Client._on_socket_open).parameters)
    queued = list(inspect.signature(paho.Client._packet_queue).parameters)

    assert isinstance(client._client, paho.Client), MOVED + "Client._client"
    assert client._client._sock is None, MOVED + "paho's _sock"
    assert isinstance(client._disconnected, asyncio.Future), MOVED + "_disconnected"
    assert client._loop is asyncio.get_running_loop(), MOVED + "_loop"
    assert opened == ["self", "client", "userdata", "sock"], MOVED + "_on_socket_open"
    assert queued[:5] == ["self", "command", "packet", "mid", "qos"], (
        MOVED + "paho's _packet_queue"
    )


def test_paho_reads_from_the_socket_that_it_was_given() -> None:
    client = paho.Client(CallbackAPIVersion.VERSION2)
    far, near = socket.socketpair()
    with far, near:
        near.setblocking(False)
        read = client._sock = ReadAhead(near, lambda _: None)
        far.sendall(b"\xe0\x00")
        assert read.read_ahead()

        client.loop_read()

        assert not read.pending(), MOVED + "paho's _sock"
        client._sock = None


@pytest.mark.parametrize("packet", [publish_packet, confirmed_packet])
async def test_a_mistake_of_who_listens_ends_the_link_and_not_its_connection_alone(
    packet: Callable[[str, bytes], bytes],
) -> None:
    def mistake(topic: str, _: bytes) -> None:
        raise LookupError(topic)

    with talking(packet("t", b"x")) as port:
        link = MqttLink(BrokerAddress("127.0.0.1", port), "test", {"t": 1}, mistake)
        with pytest.raises(LookupError):
            async with asyncio.timeout(20.0):
                await link.run()


@given(st.data())
def test_packets_may_come_in_any_pieces(data: st.DataObject) -> None:
    sent = [
        publish_packet("scan", b"x" * 300),
        CONNACK,
        publish_packet("odom", b""),
        confirmed_packet("answer", b"LATCHED"),
        publish_packet("ü", b"y" * 20_000),
    ]
    whole = b"".join(sent)
    cuts = sorted(data.draw(st.sets(st.integers(1, len(whole) - 1), max_size=6)))
    telemetry: dict[str, bytes] = {}
    messages: list[Qos1Message] = []
    others = begun = b""
    for start, end in itertools.pairwise([0, *cuts, len(whole)]):
        arrived, begun = sort_packets(begun + whole[start:end])
        telemetry |= arrived.telemetry
        messages += arrived.qos1
        others += arrived.others

    assert telemetry == {"scan": b"x" * 300, "odom": b"", "ü": b"y" * 20_000}
    assert messages == [Qos1Message("answer", b"LATCHED", 7)]
    assert (others, begun) == (CONNACK, b"")


def test_a_packet_of_no_proper_length_is_left_to_the_library() -> None:
    assert (
        sort_packets(b"\x30\xff\xff\xff\xffrest")[0].others
        == b"\x30\xff\xff\xff\xffrest"
    )
