"""Records the output of the whole stack during a scenario, as a page receives it."""

import asyncio
import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import httpx
import orjson
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException
from websockets.typing import Subprotocol

from iveg.adapters import clock
from iveg.lab.experiment.beliefs import belief_in
from iveg.lab.experiment.message_times import MessageTimes
from iveg.lab.experiment.recording import Row, RunRecording, picture_of
from iveg.lab.experiment.slices import Slice, slice_between

_MAP_EVERY_S = 1.0
_SLICE_S = 5.0
_PATIENCE_S = 20.0
"""For the table of latency: iVeg starts a process of its own for the first (s)."""


@dataclass(slots=True)
class ObservedRun(RunRecording):
    """Recorded output of ``/live`` and the API.

    Attributes:
        slices: Latencies of decisions in slices of a few seconds.
        edges: When each slice began, and the last one ended (Unix s).
        read: Messages that reached the broker by iVeg's own count, and how many it
            ``skipped`` of them because newer ones were there.
        times: Each message between the first edge and the last.
        settled: Whether Orion kept up when the first slice began.
        stops: STOP of the fleet, robot by robot; empty unless it was the last run.
    """

    slices: list[Slice] = field(default_factory=list)
    edges: list[float] = field(default_factory=list)
    read: dict[str, int] = field(default_factory=dict)
    times: list[MessageTimes] = field(default_factory=list)
    settled: bool = True
    stops: list[Row] = field(default_factory=list)

    @property
    def measured(self) -> list[Row]:
        """The truth between the first edge and the last."""
        begin, end = self.edges[0], self.edges[-1]
        return [row for row in self.truth if begin <= row["at"] <= end]


async def watch(url: str, token: str, seconds: float, robot_id: str) -> ObservedRun:
    """Record for ``seconds``; an error ends the recording with what it has.

    Args:
        url: Address of the page, ``http://…``.
        token: Bearer token of a program.
        seconds: Duration (s).
        robot_id: Robot whose costmap is requested once a second.
    """
    watched = ObservedRun()
    bearer = {"Authorization": f"Bearer {token}"}
    async with httpx.AsyncClient(
        base_url=f"{url}/api/v1", headers=bearer, trust_env=False
    ) as api:
        beside = [
            asyncio.create_task(_listen(url, bearer, watched)),
            asyncio.create_task(_believe(api, robot_id, watched)),
        ]
        try:
            await _measure(api, seconds, watched)
        finally:
            for task in beside:
                task.cancel()
            await asyncio.gather(*beside, return_exceptions=True)
    return watched


async def _measure(
    api: httpx.AsyncClient, seconds: float, watched: ObservedRun
) -> None:
    """A slice every few seconds, the last one at the end."""
    slices = max(1, math.floor(seconds / _SLICE_S))
    start = before = await _read_latency(api)
    watched.edges.append(clock.wall())
    for _ in range(slices):
        await asyncio.sleep(seconds / slices)
        now = await _read_latency(api)
        watched.edges.append(clock.wall())
        both = before is not None and now is not None
        watched.slices.append(
            slice_between(before["rows"], now["rows"]) if both else {}
        )
        before = now or before
    if start is not None and before is not None:
        watched.read = _read_between(start["streams"], before["streams"])


async def _read_latency(api: httpx.AsyncClient) -> Any:
    """Response of the latency API since iVeg's start; None: none."""
    path = "/latency?window=24h&figures=false&bins=true"
    try:
        answer = await api.get(path, timeout=_PATIENCE_S)
        return answer.raise_for_status().json()
    except httpx.HTTPError:
        return None


def _read_between(before: Sequence[Row], after: Sequence[Row]) -> dict[str, int]:
    def more(name: str) -> int:
        start, end = (sum(one["uplink"][name] for one in x) for x in (before, after))
        return int(end - start)

    return {"passed": more("passed"), "skipped": more("skipped")}


async def _listen(url: str, bearer: dict[str, str], watched: ObservedRun) -> None:
    address = url.replace("http", "ws", 1) + "/live"
    # A closed connection ends the recording, which keeps its frames.
    with contextlib.suppress(WebSocketException, OSError):
        async with connect(
            address,
            additional_headers=bearer,
            subprotocols=[Subprotocol("iveg.2")],
            proxy=None,
        ) as line:
            async for message in line:
                if isinstance(message, bytes):
                    number = _hear(message, watched)
                    await line.send(f'{{"type":"painted","frame":{number}}}')


def _hear(frame: bytes, watched: ObservedRun) -> int:
    """Keep the pictures of one frame of telemetry; its number."""
    end = 4 + int.from_bytes(frame[:4], "little")
    head = orjson.loads(frame[4:end])
    for part in head["parts"]:
        if part["topic"].startswith("detections/"):
            picture = picture_of(part["data"])
            if picture is not None:
                watched.reported.append(picture)
    return int(head["frame"])


async def _believe(api: httpx.AsyncClient, robot_id: str, watched: ObservedRun) -> None:
    while True:
        with contextlib.suppress(httpx.HTTPError):
            answer = await api.get(f"/costmap?robot={robot_id}")
            if answer.status_code == 200 and watched.reported:
                # Clock of the detection frames, with which it is compared.
                newest = watched.reported[-1].at
                watched.beliefs.append((newest, belief_in(answer.json())))
        await asyncio.sleep(_MAP_EVERY_S)
