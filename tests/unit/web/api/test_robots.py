"""The REST twins of what is live say what is known and how old it is."""

from typing import Any

import numpy as np
import pytest

from iveg.domain.observations import Hold
from tests.builders import scan
from tests.unit.web.desk import WebDesk


async def get(desk: WebDesk, path: str) -> Any:
    async with desk.browser("viewer") as browser:
        answer = await browser.get(f"/api/v1{path}")
    assert answer.status_code == 200
    return answer.json()


async def test_a_robot_that_was_never_heard_is_all_unknown() -> None:
    told = await get(WebDesk(), "/robots/AGI")

    assert (told["link"], told["mode"]) == ("UNKNOWN", "SLOW")
    assert (told["pose"], told["age_s"], told["speed_factor"]) == (None, None, None)
    assert told["speed_limit"]["speed_factor"] == 0.5


@pytest.mark.parametrize(
    ("holds", "factor", "mode"),
    [
        ((Hold("hw-1", "hw", "local"),), 0.0, "STOPPED"),
        ((), 0.0, "STOPPED"),
        ((), 0.5, "SLOW"),
        ((), 1.0, "RUNNING"),
    ],
)
async def test_the_mode_is_what_the_robot_says(
    holds: tuple[Hold, ...], factor: float, mode: str
) -> None:
    desk = WebDesk()
    desk.report("AGI", *holds, factor=factor, reason="clear")

    told = await get(desk, "/robots/AGI")

    assert told["mode"] == mode
    assert [one["id"] for one in told["holds"]] == [hold.id for hold in holds]


async def test_the_costmap_is_rows_from_the_south_western_corner_of_all_or_one() -> (
    None
):
    desk = WebDesk()
    desk.drive("AGI", 0.05)
    desk.hear(scan("AGI", [2.0] * 4, origin=desk.next_origin()))
    desk.parts.mapper.tick(desk.clock())

    async with desk.browser("viewer") as browser:
        told = (await browser.get("/api/v1/costmap")).json()
        agi = (await browser.get("/api/v1/costmap?robot=AGI")).json()
        agii = (await browser.get("/api/v1/costmap?robot=AGII")).json()
        nobody = await browser.get("/api/v1/costmap?robot=AGIII")

    data = np.array(told["data"]).reshape(told["height"], told["width"])
    column = int((2.05 - told["origin"]["x"]) / told["resolution"])
    row = int((0.05 - told["origin"]["y"]) / told["resolution"])
    assert told["resolution"] * told["width"] <= 200.0
    assert data[row, column] > 0
    assert data[0, 0] == -1
    assert agi["width"] > agii["width"] == 0
    assert nobody.status_code == 404
