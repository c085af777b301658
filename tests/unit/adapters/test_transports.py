"""The FIWARE transport: what reaches Orion, and what its failures become."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import orjson
import pytest

from iveg.adapters.orion import OrionClient
from iveg.adapters.transports import OrionTransport
from iveg.domain.goals import CancelOrder, Goal, GoalOrder


@asynccontextmanager
async def orion(
    status: bytes, *, answers: bool = True
) -> AsyncIterator[tuple[OrionTransport, list[tuple[str, object]]]]:
    """A server that answers every request alike, and what it was asked."""
    asked: list[tuple[str, object]] = []
    hanging = asyncio.Event()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await reader.readuntil(b"\r\n\r\n")
        length = int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0])
        body = orjson.loads(await reader.readexactly(length))
        asked.append((head.split(b"\r\n")[0].decode(), body))
        if not answers:
            await hanging.wait()
        writer.write(b"HTTP/1.1 " + status + b"\r\nContent-Length: 0\r\n\r\n")
        await writer.drain()
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    async with OrionClient(f"http://127.0.0.1:{port}", "s", "/p") as client:
        yield OrionTransport(client), asked
    hanging.set()
    server.close()
    await server.wait_closed()


@pytest.mark.parametrize(
    ("what", "value"),
    [
        ("stop", {"stop": {"id": "01A", "by": "x"}}),
        (
            "release",
            {"release": {"ids": ["01A", "boot-1"], "ch": "c", "attempt": "01T"}},
        ),
        ("resume", {"resume": {"ch": "c", "attempt": "01T"}}),
    ],
)
async def test_a_command_is_one_attribute_alone(what: str, value: object) -> None:
    async with orion(b"204 No Content") as (transport, asked):
        calls = {
            "stop": lambda: transport.stop("AGI", "01A", "x"),
            "release": lambda: transport.release("AGI", ["01A", "boot-1"], "c", "01T"),
            "resume": lambda: transport.resume("AGI", "c", "01T"),
        }
        await calls[what]()

    assert asked == [
        (
            "PATCH /v2/entities/AGI/attrs?type=Robot HTTP/1.1",
            {"cmd": {"type": "command", "value": value}},
        )
    ]


async def test_a_goal_is_a_command_of_its_own_alone() -> None:
    goal = Goal("01G", "aisle", 10.0, 7.5)
    async with orion(b"204 No Content") as (transport, asked):
        await transport.goal("AGI", GoalOrder(goal, "c", 17.5))
        await transport.goal("AGI", CancelOrder("01G"))

    told = {"id": "01G", "kind": "aisle", "x": 10.0, "y": 7.5, "ch": "c", "until": 17.5}
    assert [body for _, body in asked] == [
        {"goal": {"type": "command", "value": {"set": told}}},
        {"goal": {"type": "command", "value": {"cancel": {"id": "01G"}}}},
    ]
