"""Goals by REST: who may send one, and one clear problem for each that is refused."""

from importlib.resources import files

import orjson
import pytest

from iveg.domain.goals import REASONS
from iveg.domain.observations import Hold
from tests.unit.comfort.test_goals import free, say
from tests.unit.vital.desk import settle
from tests.unit.web.desk import WebDesk

GOAL = "/api/v1/robots/AGI/goal"
THERE = {"kind": "here", "x": 5.0, "y": 6.0}


async def test_a_goal_is_sent_and_shown_with_the_robot() -> None:
    desk = WebDesk()
    free(desk)
    async with desk.browser() as browser:
        given = await browser.post(GOAL, json=THERE)
        await settle()
        say(desk, "ACCEPTED")
        shown = (await browser.get("/api/v1/robots/AGI")).json()["goal"]
        cancelled = await browser.delete(GOAL)

    told = given.json()
    assert given.status_code == 202
    assert (told["state"], told["kind"], told["by"]) == ("SENT", "here", "ana")
    assert (shown["goal_id"], shown["state"]) == (told["goal_id"], "DRIVING")
    assert (cancelled.status_code, cancelled.json()["state"]) == (202, "CANCELLING")


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ('{"kind": "here", "x": NaN, "y": 1}', 422),
        ('{"kind": "here", "x": 1e5, "y": 1}', 409),
        ('{"kind": "aisle", "aisle": "Pasillo 99"}', 409),
    ],
)
async def test_a_bad_goal_is_one_problem_and_disturbs_nothing(
    body: str, status: int
) -> None:
    desk = WebDesk()
    free(desk)
    async with desk.browser() as browser:
        headers = {"Content-Type": "application/json"}
        answer = await browser.post(GOAL, content=body, headers=headers)
    await settle()

    assert answer.status_code == status
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert answer.json()["detail"]
    assert desk.fleet.goals == []
    assert desk.parts.goals.newest("AGI", desk.clock()) is None
    assert desk.commander.machine("AGI").state == "RUNNING"


async def test_a_held_robot_an_unheard_one_and_a_stranger_are_problems() -> None:
    desk = WebDesk()
    free(desk, Hold("hw-1", "hw", "local"))
    async with desk.browser() as browser:
        held = await browser.post(GOAL, json=THERE)
        unheard = await browser.post("/api/v1/robots/AGII/goal", json=THERE)
        stranger = await browser.post("/api/v1/robots/AGX/goal", json=THERE)
        none = await browser.delete(GOAL)

    assert [(one.status_code, one.json().get("why")) for one in (held, unheard)] == [
        (409, "held"),
        (409, "no_pose"),
    ]
    assert stranger.status_code == 404
    assert (none.status_code, none.json()["why"]) == (409, "no_goal")


def test_every_reason_has_a_text_of_the_page() -> None:
    page = orjson.loads(files("iveg").joinpath("static/i18n/en.json").read_bytes())

    assert set(REASONS) - set(page["goal"]["refused"]) == set()
