"""Notifications of an entity arrive in order, whatever their receiver does."""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import orjson
import pytest

from iveg.lab.embedded import subscriptions
from iveg.lab.embedded.entities import Entity, EntityChange, apply
from iveg.lab.embedded.subscriptions import (
    CLOSED,
    MOST_WAITING,
    REFUSED,
    TIMED_OUT,
    Lane,
    Outbox,
    Subscription,
    read_subscription,
)
from tests.patience import PATIENCE_S
from tests.ports import free_ports

OK = b"HTTP/1.1 204 No Content\r\n\r\n"
SUCCESS = (204, "")
Talk = Callable[[asyncio.StreamReader, asyncio.StreamWriter, int], Awaitable[None]]


class Subscribed(Subscription):
    """A subscription that keeps the outcomes of its notifications."""

    outcomes: asyncio.Queue[tuple[int, str]]

    def succeeded(self, now: float, status: int) -> None:
        super().succeeded(now, status)
        self.outcomes.put_nowait((status, ""))

    def failed(self, now: float, reason: str) -> None:
        super().failed(now, reason)
        self.outcomes.put_nowait((0, reason))

    async def ends(self, count: int) -> list[tuple[int, str]]:
        """The outcomes of so many notifications, in the order of their ends."""
        async with asyncio.timeout(PATIENCE_S):
            return [await self.outcomes.get() for _ in range(count)]


def subscribed(port: int, timeout_ms: int = 60_000) -> Subscribed:
    document = {
        "subject": {"entities": [{"idPattern": ".*"}]},
        "notification": {
            "http": {"url": f"http://127.0.0.1:{port}/n", "timeout": timeout_ms}
        },
    }
    read = read_subscription(document, "", "/")
    made = Subscribed(read.id, read.document, read.path, read.service)
    made.outcomes = asyncio.Queue()
    return made


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


async def read_one(reader: asyncio.StreamReader) -> bytes:
    head = await reader.readuntil(b"\r\n\r\n")
    length = int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0])
    return await reader.readexactly(length)


async def sent(talk: Talk, count: int, timeout_ms: int = 60_000) -> Subscribed:
    """A lane to a receiver has sent so many; their outcomes wait in the answer."""
    async with receiver(talk) as port:
        to = subscribed(port, timeout_ms)
        lane = Lane(to, time.time)
        for number in range(count):
            lane.send(b"%d" % number)
        ended = await to.ends(count)
        lane.close()
    for outcome in ended:
        to.outcomes.put_nowait(outcome)
    return to


async def test_each_entity_has_a_connection_on_which_its_values_keep_their_order() -> (
    None
):
    heard: dict[int, list[tuple[str, int]]] = {}

    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        while True:
            (told,) = orjson.loads(await read_one(reader))["data"]
            heard.setdefault(number, []).append((told["id"], told["n"]["value"]))
            writer.write(OK)

    async with receiver(talk) as port:
        to, outbox = subscribed(port), Outbox(time.time)
        for value in range(100):
            for name in ("AGI", "AGII"):
                entity = Entity(name, "Robot", "/", 0.0, 0.0)
                apply(entity, {"n": EntityChange("Number", value)}, 0.0)
                outbox.post(to, entity, 0.0)
        assert set(await to.ends(200)) == {SUCCESS}
        outbox.close()
    assert sorted(heard.values()) == [
        [(name, value) for value in range(100)] for name in ("AGI", "AGII")
    ]


async def test_a_receiver_that_closes_each_time_is_served_all_the_same() -> None:
    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, _: int
    ) -> None:
        await read_one(reader)
        writer.write(b"HTTP/1.0 200 OK\r\nContent-Length: 0\r\n\r\n")

    to = await sent(talk, 3)
    assert await to.ends(3) == [(200, "")] * 3


@pytest.mark.parametrize(
    ("said", "timeout_ms", "reason"),
    [
        (b"", 60_000, CLOSED),
        (b"nonsense\r\n\r\n", 60_000, CLOSED),
        (None, 50, TIMED_OUT),
    ],
    ids=["hangs up", "speaks no HTTP", "is silent"],
)
async def test_a_failure_is_told_and_the_next_one_goes_on(
    said: bytes | None, timeout_ms: int, reason: str
) -> None:
    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        await read_one(reader)
        if number == 1 and said is not None:
            writer.write(said)
            return
        while number > 1:
            writer.write(OK)
            await read_one(reader)
        await reader.read()

    first, *others = await (await sent(talk, 3, timeout_ms)).ends(3)
    assert first == (0, reason)
    # A busy machine may take longer than 50 ms for one more.
    assert timeout_ms == 50 or others == [SUCCESS] * 2


async def test_a_receiver_that_is_away_is_refused_at_once() -> None:
    (port,) = free_ports(1)
    to = subscribed(port)
    lane = Lane(to, time.time)
    lane.send(b"0")
    lane.send(b"1")
    assert await to.ends(2) == [(0, REFUSED)] * 2
    lane.close()


async def test_a_connection_that_was_idle_for_long_is_not_used_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(subscriptions, "IDLE_S", -1.0)
    numbers: list[int] = []

    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        while True:
            await read_one(reader)
            numbers.append(number)
            writer.write(OK)

    await sent(talk, 3)
    assert numbers == [1, 2, 3]


@pytest.mark.parametrize(
    ("waiting", "dropped", "lines"),
    [(60, 0, 0), (MOST_WAITING + 2, 2, 2)],
    ids=["two seconds at 30 Hz", "more than a lane holds"],
)
async def test_a_stall_is_held_and_a_full_lane_says_so_once_and_its_end_once(
    waiting: int, dropped: int, lines: int, caplog: pytest.LogCaptureFixture
) -> None:
    goes_on = asyncio.Event()
    heard: list[bytes] = []

    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, _: int
    ) -> None:
        while True:
            heard.append(await read_one(reader))
            await goes_on.wait()
            writer.write(OK)

    async with receiver(talk) as port:
        to = subscribed(port)
        lane = Lane(to, time.time)
        # The first is under way and no longer waits.
        for number in range(waiting + 1):
            lane.send(b"%d" % number)
        goes_on.set()
        ended = await to.ends(waiting + 1)
        lane.close()
    assert ended == [(0, TIMED_OUT)] * dropped + [SUCCESS] * (waiting + 1 - dropped)
    wanted = [0, *range(1 + dropped, waiting + 1)]
    assert heard == [b"%d" % number for number in wanted]
    assert len(caplog.records) == lines
