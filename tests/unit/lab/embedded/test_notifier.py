import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import pytest

from iveg.lab.embedded import notifier
from iveg.lab.embedded.http_requests import NotificationTarget
from iveg.lab.embedded.http_server import Request, Response, http_server
from iveg.lab.embedded.notifier import (
    CLOSED,
    REFUSED,
    TIMED_OUT,
    Delivery,
    DeliveryLane,
    exchange,
)

OK = b"HTTP/1.1 204 No Content\r\n\r\n"
Outcome = tuple[int, bytes | str]


def post(body: bytes) -> bytes:
    head = b"POST /n HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" % len(body)
    return head + body


class Outcomes:
    """What became of deliveries, in the order in which it was known."""

    def __init__(self) -> None:
        self.known: list[tuple[bytes, Outcome]] = []
        self._changed = asyncio.Event()

    def of(self, body: bytes, timeout_s: float = 2.0) -> Delivery:
        def done(status: int, answer: bytes | str) -> None:
            self.known.append((body, (status, answer)))
            self._changed.set()

        return Delivery(post(body), timeout_s, done)

    async def number(self, count: int) -> list[tuple[bytes, Outcome]]:
        async with asyncio.timeout(30):
            while len(self.known) < count:
                self._changed.clear()
                await self._changed.wait()
        return self.known


@asynccontextmanager
async def receiver(
    talk: Callable[[asyncio.StreamReader, asyncio.StreamWriter, int], Awaitable[None]],
) -> AsyncIterator[NotificationTarget]:
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
        yield NotificationTarget("127.0.0.1", server.sockets[0].getsockname()[1])
    finally:
        server.close()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def read_one(reader: asyncio.StreamReader) -> bytes:
    head = await reader.readuntil(b"\r\n\r\n")
    length = int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0])
    return await reader.readexactly(length)


async def test_deliveries_arrive_in_order_over_one_connection() -> None:
    heard: list[bytes] = []

    async def handle(request: Request) -> Response:
        heard.append(request.body)
        return Response(200, b"{}")

    outcomes = Outcomes()
    async with http_server(handle, "127.0.0.1", 0) as port:
        lane = DeliveryLane(NotificationTarget("127.0.0.1", port))
        bodies = [str(number).encode() for number in range(200)]
        for body in bodies:
            lane.send(outcomes.of(body))
        await outcomes.number(200)
        lane.close()
    assert heard == bodies
    assert outcomes.known == [(body, (200, b"{}")) for body in bodies]


async def test_a_receiver_that_keeps_connections_is_sent_ahead() -> None:
    ahead: list[int] = []

    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, _: int
    ) -> None:
        await read_one(reader)
        writer.write(OK)
        for _ in range(4):
            await read_one(reader)
        ahead.append(4)
        writer.write(OK * 4)
        await reader.read()

    outcomes = Outcomes()
    async with receiver(talk) as target:
        lane = DeliveryLane(target)
        for number in range(5):
            lane.send(outcomes.of(b"%d" % number))
        assert [status for _, (status, _) in await outcomes.number(5)] == [204] * 5
        lane.close()
    assert ahead == [4]


async def test_a_receiver_that_closes_each_time_is_served_all_the_same() -> None:
    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, _: int
    ) -> None:
        await read_one(reader)
        writer.write(b"HTTP/1.0 200 OK\r\nContent-Length: 0\r\n\r\n")

    outcomes = Outcomes()
    async with receiver(talk) as target:
        lane = DeliveryLane(target)
        for number in range(3):
            lane.send(outcomes.of(b"%d" % number))
        known = await outcomes.number(3)
        lane.close()
    assert [(body, status) for body, (status, _) in known] == [
        (b"0", 200),
        (b"1", 200),
        (b"2", 200),
    ]


async def test_what_a_closing_receiver_never_looked_at_goes_out_once_more() -> None:
    heard: list[bytes] = []

    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        heard.append(await read_one(reader))
        writer.write(OK)
        if number == 1:
            return
        heard.append(await read_one(reader))
        writer.write(OK)
        await reader.read()

    outcomes = Outcomes()
    async with receiver(talk) as target:
        lane = DeliveryLane(target)
        for number in range(3):
            lane.send(outcomes.of(b"%d" % number))
        known = await outcomes.number(3)
        lane.close()
    assert [status for _, (status, _) in known] == [204, 204, 204]
    assert heard == [b"0", b"1", b"2"]


async def test_a_new_receiver_that_hangs_up_is_a_failure() -> None:
    async def talk(
        reader: asyncio.StreamReader, _: asyncio.StreamWriter, __: int
    ) -> None:
        await read_one(reader)

    outcomes = Outcomes()
    async with receiver(talk) as target:
        lane = DeliveryLane(target)
        lane.send(outcomes.of(b"0"))
        assert await outcomes.number(1) == [(b"0", (0, CLOSED))]
        lane.close()


async def test_a_silent_receiver_times_out_and_the_next_delivery_goes_on() -> None:
    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        await read_one(reader)
        if number > 1:
            writer.write(OK)
        await reader.read()

    outcomes = Outcomes()
    async with receiver(talk) as target:
        lane = DeliveryLane(target)
        lane.send(outcomes.of(b"0", timeout_s=0.05))
        lane.send(outcomes.of(b"1"))
        known = await outcomes.number(2)
        lane.close()
    assert known[0] == (b"0", (0, TIMED_OUT))
    assert known[1][1][0] == 204


async def test_each_delivery_has_its_own_time_behind_one_that_was_answered() -> None:
    async def talk(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, number: int
    ) -> None:
        await read_one(reader)
        writer.write(OK)
        if number == 1:
            await read_one(reader)
        await reader.read()

    outcomes = Outcomes()
    async with receiver(talk) as target:
        lane = DeliveryLane(target)
        lane.send(outcomes.of(b"0", timeout_s=60.0))
        await outcomes.number(1)
        lane.send(outcomes.of(b"1", timeout_s=0.05))
        lane.send(outcomes.of(b"2"))
        known = await outcomes.number(3)
        lane.close()
    assert known[1] == (b"1", (0, TIMED_OUT))


async def test_a_receiver_that_is_away_is_refused_at_once() -> None:
    outcomes = Outcomes()
    lane = DeliveryLane(NotificationTarget("127.0.0.1", 1))
    lane.send(outcomes.of(b"0"))
    lane.send(outcomes.of(b"1"))
    assert [what for _, what in await outcomes.number(2)] == [(0, REFUSED)] * 2
    lane.close()


async def test_beyond_its_bound_a_lane_drops_the_oldest(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def talk(
        reader: asyncio.StreamReader, _: asyncio.StreamWriter, __: int
    ) -> None:
        await reader.read()

    outcomes = Outcomes()
    bound = notifier._MAX_QUEUED
    async with receiver(talk) as target:
        lane = DeliveryLane(target)
        for number in range(bound + 2):
            lane.send(outcomes.of(b"%d" % number))
        lane.close()
    assert [body for body, _ in outcomes.known] == [b"0", b"1"]
    assert len(caplog.records) == 1


async def test_one_exchange_gives_status_and_body() -> None:
    async def handle(request: Request) -> Response:
        return Response(200, request.body)

    async with http_server(handle, "127.0.0.1", 0) as port:
        target = NotificationTarget("127.0.0.1", port)
        assert await exchange(target, post(b"abc"), 1.0) == (200, b"abc")


def test_a_target_is_read_from_an_address() -> None:
    assert NotificationTarget.from_url("http://a:81/x") == NotificationTarget("a", 81)
    assert NotificationTarget.from_url("https://b/x") == NotificationTarget(
        "b", 443, tls=True
    )
