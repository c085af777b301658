"""What somebody does beside watching: acknowledge, measure, share, leave."""

import json
import math
import re
from contextlib import suppress
from typing import Any

import pytest
from paho.mqtt import publish
from playwright import sync_api
from playwright.sync_api import Page, expect

from iveg.adapters.mqtt import BrokerAddress
from tests.e2e.conftest import OpenPage
from tests.e2e.hands import let_go, look, open_menu
from tests.e2e.reading import ON_SCREEN, card, evaluate, serious, strip_stop, visit
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

THEMES = ("light", "dark", "sunlight")
PROBE = "<img src=x onerror=window.probed=1>"


def test_what_a_robot_believes_is_shown_named_and_remembered(page: Page) -> None:
    page.locator("[data-opens=layers-panel]").click()
    page.get_by_role("radio", name="AGII").check()
    expect(page.locator("#believing")).to_contain_text("Lo que cree AGII")

    page.reload()

    expect(page.locator("#believing")).to_contain_text("Lo que cree AGII")


def test_filters_of_the_log_are_remembered_and_never_hide_in_silence(
    page: Page,
) -> None:
    page.locator("#log li").first.wait_for()
    more = page.locator("#log-chips .chip--more")
    priority = page.locator('[data-filter="priority:P3"]')
    expect(priority).to_be_hidden()
    more.focus()
    page.keyboard.press("Enter")
    expect(more).to_be_focused()
    expect(more).to_have_attribute("aria-expanded", "true")

    priority.focus()
    page.keyboard.press("Space")
    page.locator('[data-filter="kind:speed"]').click()
    page.reload()

    # No slow-down is an alert, so these two hide everything, and say so.
    expect(page.locator("#log-empty")).to_contain_text("Velocidad · P3 aviso")
    expect(priority).to_have_attribute("aria-pressed", "true")
    expect(page.locator("#log li")).to_have_count(0)

    page.locator("#log-clear").click()
    expect(page.locator("#log li").first).to_be_visible()
    expect(page.locator("#log-clear")).to_be_hidden()
    expect(priority).to_be_hidden()


def test_a_decision_is_listed_and_has_an_address_that_opens_and_prints(
    open_page: OpenPage,
) -> None:
    page = open_page(390, 844, route="/decisions")
    row = page.locator("#decisions-rows tbody tr").first
    expect(row).to_contain_text("→ 50")
    row.locator("a").click()
    page.wait_for_url(re.compile(r"/decisions/.+"))
    record = page.locator("#decision-record")

    expect(record).to_contain_text("→ 50")
    expect(record.locator(".chain li").first).to_be_visible()
    speed = page.locator(".plot__area [data-kind=speed]")
    expect(speed).to_have_attribute("d", re.compile(r"^M[\d.]+ [\d.]+h0"))
    expect(strip_stop(page, "fleet")).to_be_visible()
    found = {theme: _serious_in(page, theme) for theme in THEMES}
    assert found == {theme: [] for theme in THEMES}

    page.emulate_media(media="print")
    expect(record.locator(".chain li").first).to_be_visible()
    assert page.locator("button:visible, [data-stop]:visible").count() == 0


def test_an_operator_teaches_a_word_and_a_threshold(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(768, 1024, route="/settings")
    words = page.locator("#aliases li")
    expect(words.filter(has_text="farmer")).to_contain_text("persona")
    before = int(page.locator("#rule-version").inner_text())

    page.locator("#alias-word").fill("Tractor")
    page.locator("#alias-class").select_option("robot")
    page.locator("#alias-add").press("Enter")
    expect(page.locator("#class-result")).to_contain_text("Sin guardar")
    page.locator("#class-save").click()
    expect(page.locator("#class-result")).to_contain_text(f"versión {before + 1}")
    expect(page.locator("#rule-version")).to_have_text(str(before + 1))
    page.locator("#rule-new-threshold-person").fill("70")
    page.locator("#rule-form button[type=submit]").click()
    expect(page.locator("#rule-version")).to_have_text(str(before + 2))
    with stack.api() as api:
        rule = api.get("rule").json()
    assert rule["aliases"]["tractor"] == "robot"
    assert rule["class_thresholds"] == {"person": 0.7}
    page.reload()
    expect(words.filter(has_text="tractor")).to_contain_text("robot")

    words.filter(has_text="tractor").locator("button").click()
    page.locator("#class-save").click()
    expect(page.locator("#rule-version")).to_have_text(str(before + 3))
    page.locator("#rule-new-threshold-person").fill("")
    page.locator("#rule-form button[type=submit]").click()
    # 13.14: fewer people would count, so it takes a second word and can be undone.
    expect(page.locator("#guard-says")).to_contain_text("ya no frenaría")
    expect(page.locator("#rule-version")).to_have_text(str(before + 3))
    page.locator("#guard-yes").click()
    expect(page.locator("#rule-version")).to_have_text(str(before + 4))
    expect(page.locator("#rule-undo")).to_contain_text("Deshacer")
    expect(words.filter(has_text="tractor")).to_have_count(0)


def test_a_rule_that_somebody_else_has_changed_is_not_overwritten(
    open_page: OpenPage,
) -> None:
    first = open_page(route="/settings", alone=True)
    second = first.context.new_page()
    second.goto(first.url)
    for page in (first, second):
        expect(page.locator("#rule-new-radius")).not_to_have_value("")

    first.locator("#rule-new-radius").fill("4")
    second.locator("#rule-new-radius").fill("3")
    second.locator("#rule-form button[type=submit]").click()
    expect(second.locator("#rule-result")).to_contain_text("Cambiada")
    expect(first.locator("#rule-radius")).to_have_text("3,0 m")
    first.locator("#rule-form button[type=submit]").click()

    expect(first.locator("#rule-result")).to_contain_text("Otra persona")
    expect(first.locator("#rule-new-radius")).to_have_value("4")
    expect(first.locator("#rule-radius")).to_have_text("3,0 m")


def test_a_goal_is_the_tap_after_its_button_and_a_plain_tap_is_none(
    open_page: OpenPage, stack: Site
) -> None:
    # Of the place that is refused a browser rightly complains.
    page = open_page(alone=True)
    sending, place = page.locator("#sending"), {"x": 10.0, "y": 6.0}

    def given() -> dict[str, Any]:
        return look(page, stack, "AGI")["goal"] or {}

    def tap(at: dict[str, float]) -> None:
        """Tap a place of ``map`` (m), wherever the picture has it now."""
        page.locator("#map-fit").click()
        x, y = evaluate(page, ON_SCREEN, [at], [])
        page.locator("#map").click(position={"x": x, "y": y})

    def is_asked() -> bool:
        # Not of a robot whose report is old at the moment of the click.
        open_menu(page, "AGI")
        here = card(page, "AGI").locator('dialog [data-goal="here"]')
        with suppress(sync_api.Error, AssertionError):
            here.click(timeout=3000)
            expect(sending).to_be_visible(timeout=3000)
            return True
        page.keyboard.press("Escape")
        return False

    def ask_for_a_place() -> None:
        let_go(page, stack, "AGI")
        until(is_asked, "the page asks for a place")

    corner = {"x": 0.5, "y": 19.5}
    tap(corner)  # nobody comes there, whose decision a plain tap would show
    ask_for_a_place()
    page.keyboard.press("Escape")
    expect(sending).to_be_hidden()
    tap(corner)
    ask_for_a_place()
    tap({"x": -1.5, "y": 10.0})
    expect(sending).to_contain_text("fuera del invernadero")
    assert given() == {}

    def is_given() -> bool:
        """Again where a busy machine left the robot's report old, as a person would."""
        ask_for_a_place()
        tap(place)
        with suppress(AssertionError):
            # A tap counts when it cannot be the first of two any more.
            until(given, "the goal is given", 10.0)
        return given() != {}

    until(is_given, "AGI has a goal")
    # The picture moves a little while it is tapped: lines come and go above the map.
    assert math.dist((given()["x"], given()["y"]), place.values()) < 0.8


def test_markup_in_a_class_and_a_note_is_text_on_every_page(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page()
    corners = {"xmin": 3, "xmax": 3.5, "ymin": 3, "ymax": 3.5, "zmin": 0, "zmax": 1}
    box = {"class_id": PROBE, "probability": 0.99, "position": corners}
    seen = json.dumps({"bounding_boxes": {**box, "frame_id": "map"}})
    broker = BrokerAddress.from_url(stack.settings["IVEG_MQTT_URL"])
    topic = "/iveg/AGI_yolox_bounding_boxes/attrs"
    publish.single(topic, seen, qos=1, hostname=broker.host, port=broker.port)
    expect(page.locator("#log")).to_contain_text("onerror")
    visit(page, "/alerts")
    with stack.paused("emulator"):
        # One that is over goes with its note as soon as it was seen.
        over = page.locator("small", has_text="terminada")
        row = page.locator("#active-alerts > li:not(:has(form[hidden]))", has_not=over)
        row.first.wait_for()
        # It is not the first any more once further alerts have come before it.
        row.first.evaluate("row => { row.id = 'noted'; row.firstChild.open = true; }")
        page.locator("#noted input").fill(PROBE)
        page.locator("#noted form:not(.notes__form) button").click()
        page.locator("#active-alerts", has_text=PROBE).wait_for()

    for route in ("/", "/alerts", "/commands", "/history", "/fleet", "/settings"):
        visit(page, route)
        assert page.locator("img[src=x]").count() == 0
        assert evaluate(page, "() => window.probed ?? null") is None


def _serious_in(page: Page, theme: str) -> list[str]:
    """All rules in the first theme; in the others the one whose answer may differ."""
    script = "([theme]) => { document.documentElement.dataset.theme = theme; }"
    evaluate(page, script, theme)
    return serious(page, *([] if theme == THEMES[0] else ["color-contrast"]))
