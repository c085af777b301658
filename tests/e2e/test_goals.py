"""A goal from the page: the card's menu asks for a place, the next tap is it."""

import math
import re
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.hands import look, open_menu
from tests.e2e.reading import ON_SCREEN, card, evaluate
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

PLACE = {"x": 10.0, "y": 6.0}
OUTSIDE = {"x": -1.5, "y": 10.0}


def tap_map(page: Page, place: dict[str, float]) -> None:
    """Tap a place of ``map`` (m), wherever the picture has it now."""
    page.locator("#map-fit").click()
    x, y = evaluate(page, ON_SCREEN, [place], [])
    page.locator("#map").click(position={"x": x, "y": y})


def ask_for_a_place(page: Page) -> None:
    open_menu(page, "AGI")
    panel = card(page, "AGI").locator("dialog")
    expect(panel.locator('[data-part="goal-why"]')).to_have_text("It may be sent.")
    panel.locator('[data-goal="here"]').click()
    expect(page.locator("#sending")).to_contain_text("Tap the place to send AGI to")


def was_sent(answer: Locator) -> bool:
    """What became of an order: a robot whose data are just old is sent nowhere."""
    expect(answer).to_contain_text(re.compile("on its way to the robot|no recent data"))
    return "on its way" in (answer.text_content() or "")


def test_a_goal_is_tapped_and_driven_and_a_plain_tap_is_none(
    open_page: OpenPage, stack: Site
) -> None:
    # Of the place that is refused a browser rightly complains.
    page = open_page(locale="en-GB", alone=True)

    def goal() -> dict[str, Any]:
        return look(page, stack, "AGI")["goal"] or {}

    tap_map(page, PLACE)
    ask_for_a_place(page)
    page.locator("#sending-end").click()
    expect(page.locator("#sending")).to_be_hidden()
    ask_for_a_place(page)
    page.keyboard.press("Escape")
    expect(page.locator("#sending")).to_be_hidden()
    tap_map(page, PLACE)
    assert goal() == {}

    ask_for_a_place(page)
    tap_map(page, OUTSIDE)
    expect(page.locator("#sending")).to_contain_text(
        "the place is outside the greenhouse"
    )
    assert goal() == {}

    def has_driven() -> bool:
        ask_for_a_place(page)
        tap_map(page, PLACE)
        if not was_sent(page.locator("#sending")):
            return False
        ends = ("REACHED", "REFUSED", "DELETED")
        until(lambda: goal()["state"] in ends, "AGI is there, or had to stop")
        return bool(goal()["state"] == "REACHED")

    until(has_driven, "AGI is there")
    pose, given = look(page, stack, "AGI")["pose"], goal()
    # The picture moves a little while it is tapped: lines come and go above the map.
    assert math.dist((given["x"], given["y"]), PLACE.values()) < 0.8
    assert math.dist((pose["x"], pose["y"]), (given["x"], given["y"])) < 0.6
    open_menu(page, "AGI")
    said = card(page, "AGI").locator('[data-part="goal-state"]')
    expect(said).to_contain_text("the robot is there")

    panel = card(page, "AGI").locator("dialog")
    panel.locator('[data-part="goal-aisle"]').select_option(label="Aisle 3")

    def is_sent_to_aisle() -> bool:
        panel.locator('[data-goal="aisle"]').click()
        return was_sent(panel.locator('[data-part="goal-result"]'))

    until(is_sent_to_aisle, "AGI is sent to an aisle")
    until(lambda: goal()["kind"] == "aisle", "its goal is an aisle", 10.0)
    orders = open_page(locale="en-GB", route="/commands").locator("#orders-rows")
    expect(orders).to_contain_text("Goal: Aisle 3")
    expect(orders).to_contain_text("Is at its goal")
