"""How MQTT is read: in large pieces, and of what waits only the newest."""

import asyncio
import contextlib
import socket
import threading
from collections.abc import Iterator

import aiomqtt
import pytest

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.adapters.mqtt_inbox import Inbox, ReadAhead
from iveg.embedded.mqtt_telemetry import publish_packet

MANY = 300
CONNACK = b"\x20\x02\x00\x00"


@pytest.fixture
def line() -> Iterator[tuple[socket.socket, ReadAhead]]:
    far, near = socket.socketpair()
    with far, near:
        near.setblocking(False)
        yield far, ReadAhead(near)


def test_an_event_takes_from_the_wire_once_however_much_there_is(
    line: tuple[socket.socket, ReadAhead],
) -> None:
    far, near = line
    far.sendall(b"abcd")
    assert near.recv(1) == b"a"
    far.sendall(b"efgh")
    assert near.pending() == 3
    assert near.recv(9) == b"bcd"
    with pytest.raises(BlockingIOError):
        near.recv(1)
    assert near.pending() == 0
    assert near.recv(9) == b"efgh"


def test_an_end_of_the_line_is_an_end(line: tuple[socket.socket, ReadAhead]) -> None:
    far, near = line
    far.sendall(b"a")
    far.close()
    assert near.recv(9) == b"a"
    assert near.pending() == 0
    assert near.recv(9) == b""


@contextlib.contextmanager
def talking(packets: bytes) -> Iterator[int]:
    """A broker that admits one client and says everything at once."""

    def serve() -> None:
        client, _ = server.accept()
        with client:
            client.recv(1000)
            client.sendall(CONNACK)
            subscribe = client.recv(1000)
            client.sendall(b"\x90\x03" + subscribe[2:4] + b"\x00" + packets)
            client.recv(1000)

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


def letter(topic: str, payload: str, qos: int = 0) -> aiomqtt.Message:
    return aiomqtt.Message(
        aiomqtt.Topic(topic),
        payload.encode(),
        qos,
        retain=False,
        mid=1,
        properties=None,
    )


def emptied(inbox: Inbox) -> list[tuple[str, bytes]]:
    read = [inbox.get_nowait() for _ in range(inbox.qsize())]
    return [(one.topic.value, bytes(one.payload)) for one in read]


def test_of_telemetry_that_waits_the_newest_of_each_topic_is_read() -> None:
    inbox = Inbox()

    for number in range(3000):
        inbox.put_nowait(letter(f"t/{number % 2}", str(number)))

    assert emptied(inbox) == [("t/0", b"2998"), ("t/1", b"2999")]


def test_what_was_sent_with_a_receipt_is_all_read_in_its_order() -> None:
    inbox = Inbox()

    for number in range(3):
        inbox.put_nowait(letter("t", f"look {number}"))
        inbox.put_nowait(letter("t", f"answer {number}", qos=1))

    read = [payload for _, payload in emptied(inbox)]
    assert read == [b"look 2", b"answer 0", b"answer 1", b"answer 2"]


def test_an_inbox_that_was_emptied_takes_the_same_topic_again() -> None:
    inbox = Inbox()
    inbox.put_nowait(letter("t", "first"))
    inbox.get_nowait()

    inbox.put_nowait(letter("t", "second"))

    assert emptied(inbox) == [("t", b"second")]
