"""Notifications of an entity arrive in order, whatever their receiver does."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import orjson
import pytest

from iveg.lab.embedded import subscriptions
from iveg.lab.embedded.entities import Attribute, Entity
from iveg.lab.embedded.subscriptions import (
    CLOSED,
    MOST_WAITING,
    TIMED_OUT,
    Lane,
    Subscription,
)
from tests.patience import PATIENCE_S

OK = b"HTTP/1.1 204 No Content\r\n\r\n"
Talk = Callable[[asyncio.StreamReader, asyncio.StreamWriter, int], Awaitable[None]]


class Subscribed(Subscription):
    """A subscription that keeps how its notifications ended."""

    def __init__(self, port: int, timeout_ms: int = 60_000) -> None:
        endpoint = {"url": f"http://127.0.0.1:{port}/n", "timeout": timeout_ms}
        document = {
            "subject": {"entities": [{"idPattern": ".*"}]},
            "notification": {"http": endpoint},
        }
        super().__init__("1", document, "", "/")
        self._failures: asyncio.Queue[str] = asyncio.Queue()

    def ended(self, failure: str = "") -> None:
        super().ended(failure)
        self._failures.put_nowait(failure)

    async def failures(self, count: int) -> list[str]:
        """Failures of so many notifications, in the order of their ends."""
        async with asyncio.timeout(PATIENCE_S):
            return [await self._failures.get() for _ in range(count)]


@asynccontextmanager
async def receiver(talk: Talk) -> AsyncIterator[int]:
    """A server that does with its nth connection whatever ``talk`` says."""
    count = 0
    tasks: set[asyncio.Task[None]] = set()

    async def connected(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        nonlocal count
        count += 1
        task = asyncio.current_task()
        assert task is not None
        tasks.add(task)
        gone = (ConnectionError, asyncio.IncompleteReadError, asyncio.CancelledError)
        with contextlib.suppress(*gone):
            await talk(reader, writer, count)
        writer.close()

    server = await asyncio.start_server(connected, "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def read_request(reader: asyncio.StreamReader) -> bytes:
    head = await reader.readuntil(b"\r\n\r\n")
    length = int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0])
    return await reader.readexactly(length)


async def failures(talk: Talk, count: int, timeout_ms: int = 60_000) -> list[str]:
    """How so many notifications ended that a lane sent to a receiver."""
    async with receiver(talk) as port:
        to = Subscribed(port, timeout_ms)
        lane = Lane(to)
        for number in range(count):
            lane.send(b"%d" % number)
        ended = await to.failures(count)
        lane.close()
    return ended


async def test_each_entity_has_a_connection_on_which_its_values_keep_their_order() -> (
    None
):
    received: dict[int, list[tuple[str, int]]] = {}

    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        while True:
            (entity,) = orjson.loads(await read_request(reader))["data"]
            value = entity["id"], entity["n"]["value"]
            received.setdefault(number, []).append(value)
            writer.write(OK)

    async with receiver(talk) as port:
        to = Subscribed(port)
        for value in range(100):
            for name in ("AGI", "AGII"):
                entity = Entity(name, "Robot", "/")
                entity.apply({"n": Attribute("Number", value)}, 0.0)
                to.notify(entity, 0.0)
        assert set(await to.failures(200)) == {""}
        to.close()
    assert sorted(received.values()) == [
        [(name, value) for value in range(100)] for name in ("AGI", "AGII")
    ]


async def test_a_receiver_that_closes_each_time_is_served_all_the_same() -> None:
    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, _: int
    ) -> None:
        await read_request(reader)
        writer.write(b"HTTP/1.0 200 OK\r\nContent-Length: 0\r\n\r\n")

    assert await failures(talk, 3) == [""] * 3


@pytest.mark.parametrize(
    ("response", "timeout_ms", "reason"),
    [
        (b"", 60_000, CLOSED),
        (b"nonsense\r\n\r\n", 60_000, CLOSED),
        (None, 50, TIMED_OUT),
    ],
    ids=["hangs up", "speaks no HTTP", "is silent"],
)
async def test_a_failure_is_told_and_the_next_one_goes_on(
    response: bytes | None, timeout_ms: int, reason: str
) -> None:
    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        await read_request(reader)
        if number == 1 and response is not None:
            writer.write(response)
            return
        while number > 1:
            writer.write(OK)
            await read_request(reader)
        await reader.read()

    first, *others = await failures(talk, 3, timeout_ms)
    assert first == reason
    # A busy machine may take longer than 50 ms for one more.
    assert timeout_ms == 50 or others == [""] * 2


async def test_a_connection_that_was_idle_for_long_is_not_used_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(subscriptions, "IDLE_S", -1.0)
    numbers: list[int] = []

    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        while True:
            await read_request(reader)
            numbers.append(number)
            writer.write(OK)

    await failures(talk, 3)
    assert numbers == [1, 2, 3]


async def test_a_full_lane_drops_the_oldest_which_counts_as_a_failure() -> None:
    goes_on = asyncio.Event()
    received: list[bytes] = []

    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, _: int
    ) -> None:
        while True:
            received.append(await read_request(reader))
            await goes_on.wait()
            writer.write(OK)

    count = MOST_WAITING + 3
    async with receiver(talk) as port:
        to = Subscribed(port)
        lane = Lane(to)
        lane.send(b"0")
        # It is under way and no longer waits.
        await asyncio.sleep(0)
        for number in range(1, count):
            lane.send(b"%d" % number)
        goes_on.set()
        ended = await to.failures(count)
        lane.close()
    assert ended == [TIMED_OUT] * 2 + [""] * (count - 2)
    assert received == [b"%d" % number for number in (0, *range(3, count))]
