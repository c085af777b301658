"""Records the output of the whole stack during a scenario, as a page receives it."""

import asyncio
import contextlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import httpx
import orjson
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException
from websockets.typing import Subprotocol

from iveg.domain.stamps import parse_stamp
from iveg.lab.experiment.beliefs import Belief, belief_in
from iveg.lab.experiment.scoring import Picture, SeenObject
from iveg.lab.experiment.slices import Slice, slice_between

_MAP_EVERY_S = 1.0
_SLICE_S = 5.0
_ORDER = ("passed", "missing", "reordered", "repeated")


@dataclass(slots=True)
class ObservedRun:
    """Recorded output.

    Attributes:
        pictures: Detection frames of ``/live``.
        beliefs: Content of a robot's costmap at some moments (Unix s).
        slices: Latencies in slices of a few seconds.
        order: By hop, messages that passed, are missing, out of order or
            duplicated.
    """

    pictures: list[Picture] = field(default_factory=list)
    beliefs: list[tuple[float, Belief]] = field(default_factory=list)
    slices: list[Slice] = field(default_factory=list)
    order: dict[str, dict[str, int]] = field(default_factory=dict)


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
    start = before = await _told(api)
    for _ in range(slices):
        await asyncio.sleep(seconds / slices)
        now = await _told(api)
        if before is not None and now is not None:
            watched.slices.append(slice_between(before["rows"], now["rows"]))
        before = now or before
    if start is not None and before is not None:
        watched.order = _order_between(start["streams"], before["streams"])


async def _told(api: httpx.AsyncClient) -> Any:
    """Response of the latency API since iVeg's start; None: none."""
    path = "/latency?window=24h&figures=false&bins=true"
    try:
        return (await api.get(path)).raise_for_status().json()
    except httpx.HTTPError:
        return None


def _order_between(
    before: Sequence[Mapping[str, Any]], after: Sequence[Mapping[str, Any]]
) -> dict[str, dict[str, int]]:
    return {
        hop: {
            name: sum(one[hop][name] for one in after)
            - sum(one[hop][name] for one in before)
            for name in _ORDER
        }
        for hop in ("uplink", "fiware")
    }


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
                watched.pictures.append(picture)
    return int(head["frame"])


async def _believe(api: httpx.AsyncClient, robot_id: str, watched: ObservedRun) -> None:
    while True:
        with contextlib.suppress(httpx.HTTPError):
            answer = await api.get(f"/costmap?robot={robot_id}")
            if answer.status_code == 200 and watched.pictures:
                # Clock of the detection frames, with which it is compared.
                newest = watched.pictures[-1].at
                watched.beliefs.append((newest, belief_in(answer.json())))
        await asyncio.sleep(_MAP_EVERY_S)


def picture_of(told: Mapping[str, Any]) -> Picture | None:
    """One detection frame of the live topic; None without a readable stamp."""
    at = parse_stamp(told["stamp"] or "")
    if at is None:
        return None
    seen = tuple(
        SeenObject(
            str(place),
            one["class_id"],
            one["position"]["x"],
            one["position"]["y"],
            one["probability"],
        )
        for place, one in enumerate(told["items"])
    )
    return Picture(told["robot_id"], at, seen)


def slowdowns_of(decisions: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Decisions that slowed a robot: number, applied, observed, out of sight."""
    slowed = [one for one in decisions if one["reason"] in ("person", "robot")]
    return {
        "decided": len(slowed),
        "applied": sum(one["applied_at"] is not None for one in slowed),
        "observed": sum(one["observed_at"] is not None for one in slowed),
        "out_of_sight": sum(one["in_sight"] is False for one in slowed),
    }
