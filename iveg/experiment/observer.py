"""What comes out of the whole stack while a scenario runs, as a page would see it."""

import asyncio
import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import httpx
import orjson
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from iveg.domain.stamps import parse_stamp
from iveg.experiment.scoring import Picture, Seen

_MAP_EVERY_S = 1.0
_TAKEN = 50
"""Of a cell of the costmap (0 to 100)."""
Costmap = Mapping[str, Any]


@dataclass(slots=True)
class Watched:
    """Pictures that arrived, and what AGII believed at some moments (Unix s)."""

    pictures: list[Picture] = field(default_factory=list)
    beliefs: list[tuple[float, Costmap]] = field(default_factory=list)


async def watch(url: str, token: str, seconds: float, robot_id: str) -> Watched:
    """Listen for so long; what breaks off leaves what was heard.

    Args:
        url: Of the page, ``http://…``.
        token: Of a program.
        seconds: For how long.
        robot_id: Whose belief is asked for once a second.
    """
    watched = Watched()
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(seconds), asyncio.TaskGroup() as tasks:
            tasks.create_task(_listen(url, token, watched))
            tasks.create_task(_believe(url, token, robot_id, watched))
    return watched


async def _listen(url: str, token: str, watched: Watched) -> None:
    bearer = {"Authorization": f"Bearer {token}"}
    address = url.replace("http", "ws", 1) + "/live"
    # A server that goes away ends the pictures, and what was heard stays.
    with contextlib.suppress(WebSocketException, OSError):
        async with connect(address, additional_headers=bearer, proxy=None) as line:
            async for message in line:
                _hear(message, watched)


def _hear(message: str | bytes, watched: Watched) -> None:
    if isinstance(message, str) and message.startswith('{"topic":"detections/'):
        picture = picture_of(orjson.loads(message)["data"])
        if picture is not None:
            watched.pictures.append(picture)


async def _believe(url: str, token: str, robot_id: str, watched: Watched) -> None:
    bearer = {"Authorization": f"Bearer {token}"}
    async with httpx.AsyncClient(headers=bearer, trust_env=False) as client:
        while True:
            with contextlib.suppress(httpx.HTTPError):
                path = f"{url}/api/v1/costmap?robot={robot_id}"
                answer = await client.get(path)
                if answer.status_code == 200 and watched.pictures:
                    # By the clock of the pictures, with which it is compared.
                    newest = watched.pictures[-1].at
                    watched.beliefs.append((newest, answer.json()))
            await asyncio.sleep(_MAP_EVERY_S)


def picture_of(told: Mapping[str, Any]) -> Picture | None:
    """One detection frame of the live topic; None without a readable stamp."""
    at = parse_stamp(told["stamp"] or "")
    if at is None:
        return None
    seen = tuple(
        Seen(
            str(place),
            one["class_id"],
            one["position"]["x"],
            one["position"]["y"],
            one["probability"],
        )
        for place, one in enumerate(told["items"])
    )
    return Picture(told["robot_id"], at, seen)


def injections(
    truth: Sequence[Picture], beliefs: Sequence[tuple[float, Costmap]], robot_id: str
) -> dict[str, int]:
    """How often somebody whom a robot could not see stood in its costmap all the same.

    Of the moments at which another robot had a person in view and it had not:
    ``asked`` so many, ``injected`` in so many.
    """
    asked = injected = 0
    for at, belief in beliefs:
        near = [one for one in truth if abs(one.at - at) < 0.1]
        own = {s.key for one in near if one.robot_id == robot_id for s in one.seen}
        others = (s for one in near if one.robot_id != robot_id for s in one.seen)
        hidden = {
            s.key: s for s in others if s.class_id == "farmer" and s.key not in own
        }
        for one in hidden.values():
            asked += 1
            injected += _is_taken(belief, one)
    return {"asked": asked, "injected": injected}


def _is_taken(belief: Costmap, one: Seen) -> bool:
    resolution, origin = belief["resolution"], belief["origin"]
    column = int((one.x - origin["x"]) / resolution)
    row = int((one.y - origin["y"]) / resolution)
    if not (0 <= column < belief["width"] and 0 <= row < belief["height"]):
        return False
    return int(belief["data"][row * belief["width"] + column]) >= _TAKEN


def slowdowns_of(decisions: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Decisions that slowed a robot: how many, applied, observed, without sight."""
    slowed = [one for one in decisions if one["reason"] in ("person", "robot")]
    return {
        "decided": len(slowed),
        "applied": sum(one["applied_at"] is not None for one in slowed),
        "observed": sum(one["observed_at"] is not None for one in slowed),
        "out_of_sight": sum(one["in_sight"] is False for one in slowed),
    }
