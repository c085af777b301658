"""The costmap over HTTP, as numbers and as a picture."""

from io import BytesIO

import numpy as np
from PIL import Image

from tests.builders import scan
from tests.unit.web.desk import WebDesk


def swept() -> WebDesk:
    desk = WebDesk()
    desk.drive("AGI", 0.05)
    desk.hear(scan("AGI", [2.0] * 4, origin=desk.next_origin()))
    desk.parts.mapper.tick(desk.clock())
    return desk


async def test_the_costmap_is_rows_from_the_south_western_corner() -> None:
    desk = swept()

    async with desk.browser("viewer") as browser:
        told = (await browser.get("/api/v1/costmap")).json()

    data = np.array(told["data"]).reshape(told["height"], told["width"])
    column = int((2.05 - told["origin"]["x"]) / told["resolution"])
    row = int((0.05 - told["origin"]["y"]) / told["resolution"])
    assert told["resolution"] * told["width"] <= 200.0
    assert data[row, column] > 0
    assert data[0, 0] == -1


async def test_a_robot_s_own_view_is_asked_for_by_its_name() -> None:
    desk = swept()

    async with desk.browser("viewer") as browser:
        agi = (await browser.get("/api/v1/costmap?robot=AGI")).json()
        agii = (await browser.get("/api/v1/costmap?robot=AGII")).json()
        nobody = await browser.get("/api/v1/costmap?robot=AGIII")

    assert agi["width"] > 0
    assert agii["width"] == 0
    assert nobody.status_code == 404


async def test_who_accepts_a_picture_gets_one_with_the_north_up() -> None:
    desk = swept()

    async with desk.browser("viewer") as browser:
        answer = await browser.get("/api/v1/costmap", headers={"Accept": "image/png"})
        told = (await browser.get("/api/v1/costmap")).json()

    assert answer.headers["content-type"] == "image/png"
    assert answer.headers["vary"] == "Accept"
    shades = read_png(answer.content)
    data = np.array(told["data"]).reshape(told["height"], told["width"])
    assert ((shades[::-1] == 205) == (data == -1)).all()
    assert (shades[::-1][data == 0] == 255).all()


def read_png(body: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """The shades of a grey picture."""
    with Image.open(BytesIO(body)) as picture:
        assert (picture.format, picture.mode) == ("PNG", "L")
        return np.asarray(picture)
