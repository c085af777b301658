import asyncio
from collections.abc import AsyncIterator

import pytest

from iveg.adapters import fiware_http
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.orion import OrionClient
from iveg.adapters.reconciler import FiwareSite, provision
from iveg.domain.errors import HopError
from iveg.lab.embedded.server import Running
from tests.faulty_fiware import faulty_fiware

TENANT = ("agroconnect", "/greenhouse")
ODOMETRY = {"type": "object", "value": {"x": 1.0, "y": 2.0, "yaw": 0.1}}


@pytest.fixture
async def up() -> AsyncIterator[Running]:
    async with faulty_fiware() as running:
        yield running


@pytest.fixture
async def orion(up: Running) -> AsyncIterator[OrionClient]:
    async with OrionClient(up.orion_url, *TENANT) as client:
        yield client


async def put(orion: OrionClient, robot_id: str, **attributes: object) -> None:
    await orion.ask(
        "POST",
        "/v2/entities",
        query={"options": "upsert"},
        body={"id": robot_id, "type": "Robot", **attributes},
    )


async def test_all_robots_are_read_however_many_pages(orion: OrionClient) -> None:
    wanted = [f"R{number:03}" for number in range(230)]
    for robot_id in wanted:
        await put(orion, robot_id, base_pose_ground_truth=ODOMETRY)
    assert [one["id"] for one in await orion.read_robots()] == wanted


async def test_reading_robots_never_waits_for_a_stuck_agent(
    up: Running, orion: OrionClient
) -> None:
    async with IotAgentClient(up.iota_url, *TENANT) as agent:
        await provision(agent, orion, FiwareSite(["AGI"], "iveg", up.orion_url))
        await put(orion, "AGI", base_pose_ground_truth=ODOMETRY)
        await agent.ask("POST", "/test/faults", body={"stuck": True})
        async with asyncio.timeout(30):
            robots = await orion.read_robots()
        await agent.ask("POST", "/test/faults", body={})
    assert [one["id"] for one in robots] == ["AGI"]


async def test_a_connection_that_the_other_side_may_be_closing_is_not_used_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(fiware_http, "_KEPT_S", 0.02)
    ended = asyncio.Semaphore(0)

    async def answer_once(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n[]")
        await reader.read(1)
        writer.close()
        await writer.wait_closed()
        ended.release()

    async with await asyncio.start_server(answer_once, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        async with OrionClient(f"http://127.0.0.1:{port}", *TENANT) as orion:
            for _ in range(2):
                assert await orion.read_robots() == []
                await asyncio.sleep(0.1)
        for _ in range(2):
            await ended.acquire()


async def test_a_refusal_says_status_and_orions_words(orion: OrionClient) -> None:
    with pytest.raises(HopError, match=r"404 to PATCH .*has not been found"):
        await orion.update_command("NOBODY", {"stop": {"id": "1"}})


async def test_an_orion_that_is_away_is_a_hop_error() -> None:
    async with OrionClient("http://127.0.0.1:1", *TENANT) as client:
        with pytest.raises(HopError, match=r"^orion: cannot be reached"):
            await client.read_robots()
