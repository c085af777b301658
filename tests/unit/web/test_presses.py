"""Nothing that a page says of a press can refuse a STOP."""

import pytest

from iveg.domain.stop import Press
from iveg.web.presses import read_press
from iveg.web.security.roles import Principal
from tests.builders import START
from tests.unit.web.desk import WebDesk

ANA = Principal("ana", "operator")

NOTHING = Press()


@pytest.mark.parametrize(
    ("value", "press"),
    [
        ({"press_id": "a", "pressed_at": 5}, Press("a", 5.0)),
        ({"pressed_at": 1.5, "more": []}, Press(None, 1.5)),
        ({"press_id": "x" * 65, "pressed_at": True}, NOTHING),
        ({"press_id": "", "pressed_at": "7"}, NOTHING),
        ({"press_id": 7, "pressed_at": 10**400}, NOTHING),
        (None, NOTHING),
    ],
)
def test_a_press_is_read_word_by_word(value: object, press: Press) -> None:
    assert read_press(value) == press


async def test_one_press_over_http_and_over_the_socket_is_one_command() -> None:
    desk = WebDesk()
    said = {"press_id": "p", "pressed_at": START.wall - 0.25}
    async with desk.browser() as browser:
        first = await browser.post("/api/v1/robots/AGI/stop", json=said)
        await desk.face.stop("AGI", ANA, read_press({"type": "stop", **said}))
        again = await browser.post("/api/v1/robots/AGI/stop", json=said)

    assert first.json()["command_id"] == again.json()["command_id"]
    (command,) = desk.views.open_commands(desk.clock())
    assert command.requesters == ["ana"]
    assert command.times.pressed == "2023-11-14T22:13:19.750Z"
