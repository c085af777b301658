"""In the demo, nearly every slow-down can be proven from detection to odometry."""

from typing import Any

import httpx
import pytest

from tests.processes import Site, until

LINKS = ["detection", "filter", "geometry", "rule", "feedback", "applied", "observed"]
ENOUGH = 5
WATCHED_S = 90.0
MISSING = {"missing", "open"}


def ended(api: httpx.Client) -> list[dict[str, Any]] | None:
    """Decisions that are over, once there are enough of them."""
    listed = api.get("decisions", params={"limit": 100}).json()["items"]
    over = [one for one in listed if one["ended_at"] is not None]
    return over if len(over) >= ENOUGH else None


def is_whole(decision: dict[str, Any]) -> bool:
    """Whether every link is there and none is missing."""
    links = decision["links"]
    return [link["link"] for link in links] == LINKS and not any(
        link["verdict"] in MISSING for link in links
    )


@pytest.mark.slow
def test_nearly_every_slow_down_of_the_demo_carries_every_link(demo: Site) -> None:
    with demo.api() as api:
        over = until(lambda: ended(api), WATCHED_S, f"{ENOUGH} decisions that ended")
        one = api.get(f"decisions/{over[0]['decision_id']}").json()

    broken = [one for one in over if not is_whole(one)]
    assert len(broken) <= 0.05 * len(over), broken
    assert [link["link"] for link in one["links"]] == LINKS
    demo.assert_clean()


def test_an_open_decision_is_told_with_the_verdicts_of_now(demo: Site) -> None:
    with demo.api() as api:
        decision_id = until(lambda: mandated(api), WATCHED_S, "a robot that is slowed")
        told = api.get(f"decisions/{decision_id}")

    assert told.status_code == 200
    verdicts = {link["link"]: link["verdict"] for link in told.json()["links"]}
    assert list(verdicts) == LINKS
    assert verdicts["geometry"] == "ok"
    assert verdicts["rule"] == "ok"


def mandated(api: httpx.Client) -> str | None:
    """The decision behind a mandate that is in force."""
    robots = api.get("robots").json()["items"]
    found = (robot["mandate"]["decision_id"] for robot in robots)
    return next((one for one in found if one is not None), None)


def links_of(decision: dict[str, Any]) -> dict[str, str]:
    return {link["link"]: link["verdict"] for link in decision["links"]}


@pytest.mark.slow
def test_what_a_kill_leaves_open_is_closed_after_the_restart(
    driving: Site,
) -> None:
    with driving.api() as api:
        left = until(lambda: mandated(api), WATCHED_S, "a robot that is slowed")
        until(
            lambda: any(
                one["decision_id"] == left
                for one in api.get("decisions").json()["items"]
            ),
            5.0,
            "its row",
        )
    serving = next(one for one in driving.programs if one.words[0] == "serve")
    serving.kill()
    driving.start("serve")
    driving.wait_until_served()

    with driving.api() as api:
        told = until(lambda: closed(api, left), 20.0, "the row to be closed")
    assert "open" not in links_of(told).values()


def closed(api: httpx.Client, decision_id: str) -> dict[str, Any] | None:
    told: dict[str, Any] = api.get(f"decisions/{decision_id}").json()
    return told if told["ended_at"] is not None else None
