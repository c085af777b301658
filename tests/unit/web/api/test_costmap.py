"""The costmap over HTTP, as numbers and as a picture."""

import numpy as np

from tests.builders import scan
from tests.unit.web.desk import WebDesk


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
