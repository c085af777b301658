"""A goal through real processes: given by API, driven to by the emulator, and told."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.patience import PATIENCE_S
from tests.processes import EMULATOR, Site, site, until

pytestmark = pytest.mark.slow
TOLD = ["log.goal.sent.here", "log.goal.accepted", "log.goal.reached"]
THERE: dict[str, Any] = {"kind": "here", "x": 10.0, "y": 7.5}


@pytest.fixture
def driving(tmp_path: Path) -> Iterator[Site]:
    """FIWARE, dashboard and robots; orders go through Orion and the agent alone."""
    with site(tmp_path, IVEG_STOP_DIRECT="off") as place:
        place.serve()
        place.start(*EMULATOR, "--seed", "3", "--profile", "perfect")
        place.wait_until_live()
        place.wait_until_whole()
        yield place


def test_a_goal_is_driven_to_and_a_stop_deletes_the_next(driving: Site) -> None:
    own = driving.own_page
    with httpx.Client(base_url=driving.url, headers=own, timeout=PATIENCE_S) as page:
        page.post("/signin", json=driving.proof).raise_for_status()

        def robot() -> dict[str, Any]:
            return dict(page.get("/api/v1/robots/AGI").raise_for_status().json())

        def goal_is(state: str) -> dict[str, Any] | None:
            told = robot()
            return told if told["goal"]["state"] == state else None

        def told() -> list[str]:
            lines = page.get("/api/v1/log", params={"robot": "AGI"}).json()["items"]
            keys = (str(one["key"]) for one in reversed(lines))
            return [key for key in keys if key.startswith("log.goal")]

        def is_given() -> bool:
            """Again where a busy machine left its report old, as a person would."""
            answer = page.post("/api/v1/robots/AGI/goal", json=THERE)
            assert answer.status_code == 202 or answer.json()["why"] == "no_report"
            return answer.status_code == 202

        until(is_given, "the goal is given")
        there = until(lambda: goal_is("REACHED"), "AGI is at its goal")
        place = there["pose"]["x"], there["pose"]["y"]
        assert math.dist(place, (THERE["x"], THERE["y"])) < 0.6
        until(lambda: told() == TOLD or None, "the log tells each step")
        counted = page.get("/api/v1/health").json()["counters"]
        assert counted["fiware.GoalAnswer"] >= 2

        page.post("/api/v1/robots/AGI/goal", json={**THERE, "y": 16.0})
        until(lambda: goal_is("DRIVING"), "AGI is on its way")
        assert page.post("/api/v1/robots/AGI/stop").status_code == 202
        until(
            lambda: robot()["goal"]["forgotten_at"] and goal_is("DELETED"),
            "both have deleted the goal",
        )
        until(lambda: robot()["stop_state"] == "STANDING" or None, "it stands")
        held = page.post("/api/v1/robots/AGI/goal", json=THERE)
        assert (held.status_code, held.json()["why"]) == (409, "held")
    driving.assert_clean()
