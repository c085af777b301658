"""Routes and live topics of a running iVeg, held against its documents."""

import json
import re
from typing import Any

import httpx
import pytest
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from iveg.models.robot import Robot
from iveg.models.snapshot import Snapshot
from tests.architecture import documents
from tests.processes import Site

pytestmark = pytest.mark.e2e

_NOT_BY_ITSELF = {"alerts", "commands/{id}", "flood", "rule"}
"""Topics that need something to go wrong, or somebody to do something."""
INTERFACES = documents.interfaces()
_LIVE = (documents.INTERFACES / "live.md").read_text()


def test_every_route_has_its_mention(stack: Site) -> None:
    document = _document(stack)
    prefix = "/api/v1"

    unmentioned = [
        path
        for path in document["paths"]
        if _mention(path.removeprefix(prefix)) not in INTERFACES
    ]

    assert unmentioned == []


def test_every_live_topic_has_its_row_and_every_row_is_spoken(stack: Site) -> None:
    rows = set(documents.keys(documents.section(_LIVE, "Topics")))

    spoken = _listen(stack, rows)

    assert spoken <= rows
    assert {"snapshot", "robots/{id}", "robots/{id}/scan", "people"} <= spoken


def test_the_snapshot_comes_first_with_the_members_of_the_contract(
    stack: Site,
) -> None:
    with _dial(stack) as live:
        first = json.loads(live.recv(timeout=30))

    assert first["topic"] == "snapshot"
    assert set(first["data"]) == set(Snapshot.model_fields)


def test_a_robot_has_the_members_of_the_contract(stack: Site) -> None:
    with stack.api() as api:
        robot = api.get("robots/AGI").json()

    assert set(robot) == set(Robot.model_fields)


def _document(stack: Site) -> dict[str, dict[str, object]]:
    with stack.api() as api:
        answer = api.get(f"{stack.url}/openapi.json")
    assert answer.status_code == 200
    document: dict[str, dict[str, object]] = answer.json()
    return document


def _mention(path: str) -> str:
    """How the contract writes a path: every parameter is ``{id}``."""
    return re.sub(r"\{\w+\}", "{id}", path)


def _dial(stack: Site) -> ClientConnection:
    bearer = {"Authorization": f"Bearer {stack.settings['IVEG_API_TOKEN']}"}
    address = httpx.URL(stack.url).copy_with(scheme="ws", path="/live")
    return connect(
        str(address),
        additional_headers=bearer,
        subprotocols=[Subprotocol("iveg.2")],
        proxy=None,
    )


def _listen(stack: Site, wanted: set[str]) -> set[str]:
    """Topics that come within a while, robots' ids written ``{id}``."""
    heard: set[str] = set()
    with _dial(stack) as live:
        for _ in range(600):
            message = live.recv(timeout=30)
            heard |= {_unnamed(topic) for topic in _topics(message)}
            if isinstance(message, bytes):
                live.send(
                    json.dumps({"type": "painted", "frame": _head(message)["frame"]})
                )
            if heard >= wanted - _NOT_BY_ITSELF:
                break
    return heard


def _topics(message: str | bytes) -> list[str]:
    if isinstance(message, str):
        return [str(json.loads(message)["topic"])]
    head = _head(message)
    moved = [f"robots/{move[0]}" for move in head["moves"]]
    return moved + [str(part["topic"]) for part in head["parts"] + head["scans"]]


def _head(frame: bytes) -> dict[str, Any]:
    length = int.from_bytes(frame[:4], "little")
    head: dict[str, Any] = json.loads(frame[4 : 4 + length])
    return head


def _unnamed(topic: str) -> str:
    return re.sub(r"^(robots|detections|commands)/[^/]+", r"\1/{id}", topic)
