"""The FIWARE transport: what reaches Orion."""

from typing import Any

import orjson

from iveg.adapters.orion import OrionClient
from iveg.adapters.transports import OrionTransport
from iveg.domain.goals import CancelOrder, GoalOrder
from tests.http_servers import Request, Response, http_server


async def test_a_command_or_goal_is_one_attribute_alone() -> None:
    asked: list[tuple[str, dict[str, Any]]] = []

    async def answer(request: Request) -> Response:
        path = f"{request.method} {request.path} {request.query}"
        asked.append((path, orjson.loads(request.body)))
        return Response(204)

    async with (
        http_server(answer, "127.0.0.1", 0) as port,
        OrionClient(f"http://127.0.0.1:{port}", "s", "/p") as client,
    ):
        transport = OrionTransport(client)
        await transport.stop("AGI", "01A", "x")
        await transport.release("AGI", ["01A", "boot-1"], "c", "01T")
        await transport.resume("AGI", "c", "01T")
        goal = GoalOrder("01G", "aisle", 10.0, 7.5, "c", 17.5)
        await transport.goal("AGI", goal)
        await transport.goal("AGI", CancelOrder("01G"))

    stop = {"id": "01A", "by": "x"}
    resume = {"ch": "c", "attempt": "01T"}
    release = {"ids": ["01A", "boot-1"], **resume}
    told = {"id": "01G", "kind": "aisle", "x": 10.0, "y": 7.5, "ch": "c", "until": 17.5}
    assert {path for path, _ in asked} == {
        "PATCH /v2/entities/AGI/attrs {'type': 'Robot'}"
    }
    assert [body for _, body in asked] == [
        {"cmd": {"type": "command", "value": {"stop": stop}}},
        {"cmd": {"type": "command", "value": {"release": release}}},
        {"cmd": {"type": "command", "value": {"resume": resume}}},
        {"goal": {"type": "command", "value": {"set": told}}},
        {"goal": {"type": "command", "value": {"cancel": {"id": "01G"}}}},
    ]
