"""A decision in force is told, what a kill leaves open is closed, all is recorded.

That nearly every slow-down carries every link is proven on the virtual clock, in
``tests/unit/lab/emulator/test_scenarios.py``.
"""

import math
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import httpx
import pytest
from mcap.reader import make_reader

from iveg.domain.stamps import format_stamp
from tests.processes import Site, site, until

Place = tuple[float, float]
NEAR_M, SOON_S = 0.3, 0.25
LINKS = ["detection", "filter", "geometry", "rule", "feedback", "applied", "observed"]
MEASURES = ("_odom", "_lidar2D", "_yolox_bounding_boxes", "_safety", "_nav")


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Site]:
    """One that records."""
    with site(tmp_path, IVEG_RECORDINGS="on") as found:
        yield found


@pytest.mark.slow
def test_the_past_shows_robots_where_they_were_live(driving: Site) -> None:
    with driving.api() as api:
        for _ in range(3):
            until(lambda: is_shown(api), "a moment that was both seen and recorded")


def is_shown(api: httpx.Client) -> bool:
    """Whether robots are now and in the recording where they are; False: not known."""
    asked = time.time()
    live = places_of(api.get("robots").json()["items"])
    took_s = time.time() - asked
    told = {"at": format_stamp(asked)}
    past = until(lambda: picture(api, told), "its picture")
    # On a busy machine neither may be of the moment that was asked for.
    if took_s > SOON_S or asked - past["at_s"] > SOON_S:
        return False
    then = places_of(past["robots"])
    if live.keys() != then.keys():
        # A robot's first pose came since that picture.
        return False
    assert all(math.dist(place, then[it]) < NEAR_M for it, place in live.items())
    return bool(live)


def verdicts_of(decision: dict[str, Any]) -> dict[str, str]:
    return {link["link"]: link["verdict"] for link in decision["links"]}


def limiting_decision(api: httpx.Client) -> str | None:
    """The decision behind a speed limit that is in force."""
    robots = api.get("robots").json()["items"]
    found = (robot["speed_limit"]["decision_id"] for robot in robots)
    return next((one for one in found if one is not None), None)


@pytest.mark.slow
def test_an_open_decision_has_verdicts_and_a_kill_leaves_it_open_only_until_the_restart(
    driving: Site,
) -> None:
    with driving.api() as api:
        left = until(lambda: limiting_decision(api), "a robot that is slowed")
        verdicts = verdicts_of(api.get(f"decisions/{left}").raise_for_status().json())

        def is_listed() -> bool:
            rows = api.get("decisions").json()["items"]
            return left in {one["decision_id"] for one in rows}

        until(is_listed, "its row", 5.0)
    assert list(verdicts) == LINKS
    assert (verdicts["geometry"], verdicts["rule"]) == ("ok", "ok")
    with driving.api() as api:
        api.post("robots/AGI/stop").raise_for_status()
        agi = "robots/AGI"
        until(lambda: api.get(agi).json()["stop_state"] == "STANDING", "AGI stands")
    driving.newest("serve").kill()
    driving.start("serve")
    driving.wait_until_served()

    with driving.api() as api:
        told = until(lambda: closed(api, left), "the row to be closed")
    assert "open" not in verdicts_of(told).values()
    folder = driving.directory / "recordings"
    (path,) = until(lambda: [*folder.glob("*.mcap")], "its recording")
    everything_is_recorded(path)


def everything_is_recorded(path: Path) -> None:
    """By the public library alone: what a fleet says, twice, and what viewers draw."""
    topics: set[str] = set()
    with path.open("rb") as stream:
        for _, channel, _ in make_reader(stream).iter_messages():
            topics.add(channel.topic)
    measures = {f"/iveg/AGI{one}/attrs" for one in MEASURES}
    ways = {"/iveg/AGI/cmdexe", "/AGI/iveg/safety", "/ngsi/notifications"}
    drawn = {"/tf", *(f"/AGI/{one}" for one in ("pose", "scan", "detections"))}
    assert measures | ways | drawn <= topics


def picture(api: httpx.Client, asked: Mapping[str, str]) -> dict[str, Any] | None:
    answer = api.get("world", params=asked)
    return dict(answer.json()) if answer.is_success else None


def places_of(robots: Iterable[dict[str, Any]]) -> Mapping[str, Place]:
    there = ((one["robot_id"], one["pose"]) for one in robots)
    return {robot_id: (pose["x"], pose["y"]) for robot_id, pose in there if pose}


def closed(api: httpx.Client, decision_id: str) -> dict[str, Any] | None:
    told: dict[str, Any] = api.get(f"decisions/{decision_id}").json()
    return told if told["ended_at"] is not None else None
