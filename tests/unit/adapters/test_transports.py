"""The FIWARE transport: what reaches Orion."""

from collections.abc import AsyncIterator

import orjson
import pytest

from iveg.adapters.orion import OrionClient
from iveg.adapters.transports import OrionTransport
from iveg.domain.goals import CancelOrder, Goal, GoalOrder
from iveg.ngsi import codec
from tests.http_servers import Request, Response, http_server


class Orion:
    """Answers every request with 204 and remembers it."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, object]] = []

    async def answer(self, request: Request) -> Response:
        path = f"{request.method} {request.path} {request.query}"
        self.asked.append((path, orjson.loads(request.body)))
        return Response(204)


@pytest.fixture
def orion() -> Orion:
    return Orion()


@pytest.fixture
async def transport(orion: Orion) -> AsyncIterator[OrionTransport]:
    async with (
        http_server(orion.answer, "127.0.0.1", 0) as port,
        OrionClient(f"http://127.0.0.1:{port}", "s", "/p") as client,
    ):
        yield OrionTransport(client)


async def test_a_command_is_one_attribute_alone(
    orion: Orion, transport: OrionTransport
) -> None:
    await transport.stop("AGI", "01A", "x")
    await transport.release("AGI", ["01A", "boot-1"], "c", "01T")
    await transport.resume("AGI", "c", "01T")

    values = (
        codec.write_stop("01A", "x"),
        codec.write_release(["01A", "boot-1"], "c", "01T"),
        codec.write_resume("c", "01T"),
    )
    path = "PATCH /v2/entities/AGI/attrs {'type': 'Robot'}"
    assert orion.asked == [
        (path, {"cmd": {"type": "command", "value": value}}) for value in values
    ]


async def test_a_goal_is_a_command_of_its_own_alone(
    orion: Orion, transport: OrionTransport
) -> None:
    await transport.goal("AGI", GoalOrder(Goal("01G", "aisle", 10.0, 7.5), "c", 17.5))
    await transport.goal("AGI", CancelOrder("01G"))

    told = {"id": "01G", "kind": "aisle", "x": 10.0, "y": 7.5, "ch": "c", "until": 17.5}
    assert [body for _, body in orion.asked] == [
        {"goal": {"type": "command", "value": {"set": told}}},
        {"goal": {"type": "command", "value": {"cancel": {"id": "01G"}}}},
    ]
