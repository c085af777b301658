"""Issue 25, 6: Foxglove looks on through a WebSocket, and changes nothing."""

import asyncio
import contextlib
import struct
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import orjson
import pytest
import websockets

from iveg.adapters.recordings.live_feed import MOST_WAITING, DoorSetup, LiveFeed
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.recordings.writer import WriterSetup
from iveg.domain.errors import HopError
from iveg.ngsi import codec
from tests.builders import at, odometry
from tests.fakes.clock import FakeClock
from tests.ports import free_ports

ODOM = "/iveg/AGI_odom/attrs"
_HEAD = struct.Struct("<BIQ")
"""Opcode, subscription, time (ns) of a message of foxglove.sdk.v1."""


@asynccontextmanager
async def connected(port: int) -> AsyncIterator[websockets.ClientConnection]:
    address, protocol = (
        f"ws://127.0.0.1:{port}",
        websockets.Subprotocol("foxglove.sdk.v1"),
    )
    async with asyncio.timeout(20), contextlib.AsyncExitStack() as stack:
        while True:
            with contextlib.suppress(OSError):
                asked = websockets.connect(address, subprotocols=[protocol])
                yield await stack.enter_async_context(asked)
                return
            await asyncio.sleep(0.05)


async def _said(line: websockets.ClientConnection) -> Any:
    return orjson.loads(await line.recv())


async def _until(feed: LiveFeed, *, looked_on: bool) -> None:
    async with asyncio.timeout(10):
        while bool(feed.subscriptions) != looked_on:  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def test_a_client_sees_poses_in_map_and_every_write_is_refused(
    tmp_path: Path,
) -> None:
    (port,) = free_ports(1)
    feed = LiveFeed(DoorSetup(port, robots=("AGI", "AGII")))
    inputs = InputRecorder(WriterSetup(tmp_path), FakeClock(), is_on=False, live=feed)
    pose = codec.write_odometry(odometry(x=3.0, y=4.0))
    running = asyncio.create_task(feed.run())

    async with connected(port) as line:
        assert (await _said(line))["capabilities"] == []
        offered = {one["topic"]: one for one in (await _said(line))["channels"]}
        # Nobody looks on: nothing is packed.
        inputs.measure(ODOM, pose, at(0.0))
        assert not feed.waiting
        wanted = {"id": 7, "channelId": offered["/tf"]["id"]}
        await line.send(
            orjson.dumps({"op": "subscribe", "subscriptions": [wanted]}).decode()
        )
        await _until(feed, looked_on=True)
        inputs.measure(ODOM, pose, at(1.0))
        shown = await line.recv()
        assert isinstance(shown, bytes)
        assert _HEAD.unpack_from(shown)[:2] == (1, 7)
        told = orjson.loads(shown[_HEAD.size :])
        assert (told["parent_frame_id"], told["child_frame_id"]) == (
            "map",
            "AGI/base_link",
        )
        assert told["translation"] == {"x": 3.0, "y": 4.0, "z": 0.0}
        for write in (
            {
                "op": "advertise",
                "channels": [
                    {
                        "id": 1,
                        "topic": "/iveg/AGI/cmd",
                        "encoding": "json",
                        "schemaName": "",
                    }
                ],
            },
            {"op": "setParameters", "parameters": [{"name": "a", "value": 1}]},
            {"op": "fetchAsset", "uri": "file:///etc/passwd", "requestId": 1},
        ):
            await line.send(orjson.dumps(write).decode())
            refused = await _said(line)
            assert (refused["op"], refused["level"]) == ("status", 2)
        await line.send(b"\x02" + struct.pack("<III", 1, 1, 4) + b"json{}")
        assert (await _said(line))["op"] == "serviceCallFailure"

    await _until(feed, looked_on=False)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)


def test_the_newest_win_and_what_gives_way_is_counted() -> None:
    feed = LiveFeed(DoorSetup(1))
    feed.subscriptions = 1

    for n in range(MOST_WAITING + 3):
        feed.measure(ODOM, str(n).encode(), at(0.0))

    assert feed.waiting == MOST_WAITING
    assert feed.counters["foxglove_dropped"] == 3


async def test_a_port_that_is_taken_is_one_clear_problem() -> None:
    (port,) = free_ports(1)
    server = await asyncio.start_server(lambda *_: None, "127.0.0.1", port)
    async with server:
        with pytest.raises(HopError, match=r"foxglove: .*in use"):
            await LiveFeed(DoorSetup(port)).run()
