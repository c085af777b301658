"""A decision in force is told, what a kill leaves open is closed, all is recorded.

That nearly every slow-down carries every link is proven on the virtual clock, in
``tests/unit/lab/emulator/test_scenarios.py``.
"""

import asyncio
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from mcap.reader import make_reader

from iveg.adapters.recordings.chunks import ChunkedRecording
from iveg.app.past import Past
from iveg.app.site import Site as PastSite
from iveg.pipeline.trace import KEYFRAMES_S
from iveg.settings import Settings
from tests.processes import Site, site, until

LINKS = ["detection", "filter", "geometry", "rule", "feedback", "applied", "observed"]
MEASURES = ("_odom", "_lidar2D", "_yolox_bounding_boxes", "_safety", "_nav")


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Site]:
    """One that records."""
    with site(tmp_path, IVEG_RECORDINGS="on") as found:
        yield found


def limiting_decision(api: httpx.Client) -> str | None:
    """The decision behind a speed limit that is in force."""
    robots = api.get("robots").json()["items"]
    found = (robot["speed_limit"]["decision_id"] for robot in robots)
    return next((one for one in found if one is not None), None)


def links_of(decision: dict[str, Any]) -> dict[str, str]:
    return {link["link"]: link["verdict"] for link in decision["links"]}


def evidence_of(api: httpx.Client, decision: dict[str, Any]) -> list[dict[str, Any]]:
    """Detections that the history keeps and the decision names by its own keys."""
    asked = {"robot": decision["observer"], "person": decision["person_id"]}
    rows = api.get("detections", params={**asked, "limit": 1000}).json()["items"]
    return [
        row
        for row in rows
        if (row["probability"], row["position"])
        == (decision["confidence"], decision["position"])
    ]


@pytest.mark.slow
def test_the_detections_that_decisions_rest_on_are_found_by_rest(
    driving: Site,
) -> None:
    with driving.api() as api:
        decisions = until(
            lambda: [
                one
                for one in api.get("decisions").json()["items"]
                if one["confidence"] is not None
            ],
            "a decision about somebody who was seen",
        )
        for one in decisions:
            until(partial(evidence_of, api, one), one["decision_id"], 5.0)
        lines = api.get("tracks", params={"format": "csv", "limit": 1}).text
        (track,) = api.get("tracks", params={"limit": 1}).json()["items"]
        (pose,) = api.get("odometry", params={"limit": 1}).json()["items"]
    assert set(lines.splitlines()[0].split(",")) <= set(track)
    assert track["person_id"] is not None
    assert pose["robot_id"] in ("AGI", "AGII")


@pytest.mark.slow
def test_an_open_decision_has_verdicts_and_a_kill_leaves_it_open_only_until_the_restart(
    driving: Site,
) -> None:
    with driving.api() as api:
        left = until(lambda: limiting_decision(api), "a robot that is slowed")
        verdicts = links_of(api.get(f"decisions/{left}").raise_for_status().json())
        until(
            lambda: any(
                one["decision_id"] == left
                for one in api.get("decisions").json()["items"]
            ),
            "its row",
            5.0,
        )
    assert list(verdicts) == LINKS
    assert (verdicts["geometry"], verdicts["rule"]) == ("ok", "ok")
    with driving.api() as api:
        api.post("robots/AGI/stop", json={}).raise_for_status()
        until(
            lambda: api.get("robots/AGI").json()["stop"]["state"] == "STANDING",
            "AGI stands",
        )
    serving = next(one for one in driving.programs if one.words[0] == "serve")
    serving.kill()
    driving.start("serve")
    driving.wait_until_served()

    with driving.api() as api:
        told = until(lambda: closed(api, left), "the row to be closed")
    assert "open" not in links_of(told).values()
    folder = driving.directory / "recordings"
    (path,) = until(lambda: [*folder.glob("*.mcap")], "its recording")
    everything_is_recorded(path)
    # By itself, as the next server writes beside it.
    alone = path.parents[1] / "alone"
    alone.mkdir()
    moved = path.rename(alone / path.name)
    asyncio.run(its_seconds_are_made_again(driving, moved))


async def its_seconds_are_made_again(driving: Site, path: Path) -> None:
    """Each world that the live server hashed, and no other."""
    settings = Settings.from_environment(driving.settings)
    file, past = ChunkedRecording(path), Past(PastSite.of(settings, path.parent))
    first, last = file.first / 1e9, file.last / 1e9
    # A move compares the hashes of its last two seconds.
    for moment in (*np.arange(first + KEYFRAMES_S + 2.0, last, 2.0), last - 0.5):
        past.move(float(moment))
    assert past.agreement.unequal == 0
    assert past.agreement.equal > 0.5 * (last - first) / KEYFRAMES_S - 1


def everything_is_recorded(path: Path) -> None:
    """By the public library alone: what a fleet says, twice, and what became of it."""
    told: Counter[str] = Counter()
    moments: dict[str, list[int]] = {}
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            told[channel.topic] += 1
            moments.setdefault(channel.topic, []).append(message.log_time)
    measures = {f"/iveg/AGI{one}/attrs" for one in MEASURES}
    rows = {f"/iveg/{one}" for one in ("decision", "command", "commandevent", "log")}
    ways = {"/iveg/AGI/cmdexe", "/AGI/iveg/safety", "/ngsi/notifications"}
    kept = {"/iveg/ticks", "/iveg/rule", *measures, *rows, *ways}
    drawn = {"/tf", *(f"/AGI/{one}" for one in ("pose", "scan", "detections"))}
    assert kept | drawn <= set(told)
    assert told["/iveg/rule"] == 1
    ticks = moments["/iveg/ticks"]
    assert len(ticks) > 8 * (ticks[-1] - ticks[0]) / 1e9


def closed(api: httpx.Client, decision_id: str) -> dict[str, Any] | None:
    told: dict[str, Any] = api.get(f"decisions/{decision_id}").json()
    return told if told["ended_at"] is not None else None
