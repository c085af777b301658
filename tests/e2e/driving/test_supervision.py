"""What somebody does beside watching: acknowledge, measure, share, leave."""

import json
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from paho.mqtt import publish
from playwright.sync_api import Page, expect

from iveg.adapters.broker_address import BrokerAddress
from tests.e2e.conftest import OpenPage
from tests.e2e.reading import OVERFLOW, evaluate, serious, strip_stop, visit
from tests.patience import AGAIN
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

THEMES = ("light", "dark", "sunlight")
PROBE = "<img src=x onerror=window.probed=1>"


def test_a_distance_is_measured_with_two_taps_and_with_keys(page: Page) -> None:
    page.locator("#map-measure").click()
    expect(page.locator("#measured")).to_contain_text("primer punto")
    canvas = page.locator("#map")

    canvas.click(position={"x": 200, "y": 300})
    expect(page.locator("#measured")).to_contain_text("segundo punto")
    canvas.click(position={"x": 400, "y": 300})
    expect(page.locator("#measured")).to_have_text(re.compile(r"^\d+,\d\d m$"))

    canvas.focus()
    page.keyboard.press("Enter")
    expect(page.locator("#measured")).to_contain_text("segundo punto")
    page.locator("#map-measure").focus()
    page.keyboard.press("Escape")
    expect(page.locator("#measured")).to_be_hidden()


def test_what_a_robot_believes_is_shown_named_and_remembered(page: Page) -> None:
    page.locator("[data-opens=layers-panel]").click()
    page.get_by_role("radio", name="AGII").check()
    expect(page.locator("#believing")).to_contain_text("Lo que cree AGII")

    page.reload()

    expect(page.locator("#believing")).to_contain_text("Lo que cree AGII")


def test_a_layer_that_was_switched_off_stays_off(page: Page) -> None:
    page.locator("[data-opens=layers-panel]").click()
    page.get_by_role("checkbox", name="Puntos LiDAR").uncheck()

    page.reload()

    page.locator('[data-robot="AGI"][data-link="LIVE"]').wait_for()
    page.locator("[data-opens=layers-panel]").click()
    expect(page.get_by_role("checkbox", name="Puntos LiDAR")).not_to_be_checked()


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


def test_the_log_can_be_asked_for_one_rule(page: Page) -> None:
    page.locator("#log-chips .chip--more").click()
    page.locator('[data-filter="rule:person"]').click()

    shown = page.locator("#log li")
    expect(shown.first).to_contain_text(re.compile("persona"))
    kinds = {item.get_attribute("data-kind") for item in shown.all()}
    assert kinds == {"speed"}


def test_people_can_be_read_as_sentences(page: Page, stack: Site) -> None:
    page.locator("[data-opens=people-panel]").click()
    told = page.locator("#people-list li", has_text=re.compile("vista|vio"))

    def is_told() -> bool:
        _publish(stack, "AGI", _detection("person"))
        return told.filter(has_text="AGI").count() > 0

    until(is_told, "whom AGI sees")
    expect(page.locator("#people-nlos")).to_contain_text("Por alguien que no ven")


def test_a_decision_has_an_address_that_opens_and_prints(
    open_page: OpenPage, stack: Site
) -> None:
    decision_id = until(lambda: _newest_decision(stack), "a decision")
    page = open_page(390, 844, route=f"/decisions/{decision_id}")
    record = page.locator("#decision-record")

    expect(record).to_contain_text(decision_id)
    expect(record.locator(".chain li").first).to_be_visible()
    expect(strip_stop(page, "fleet")).to_be_visible()
    found = {theme: _serious_in(page, theme) for theme in THEMES}
    assert found == {theme: [] for theme in THEMES}

    page.emulate_media(media="print")
    expect(record.locator(".chain li").first).to_be_visible()
    assert page.locator("button:visible, [data-stop]:visible").count() == 0


def test_an_unknown_decision_is_said_to_be_unknown(open_page: OpenPage) -> None:
    page = open_page(route="/about", alone=True)

    visit(page, "/decisions/nothing-of-the-kind")

    expect(page.locator("#decision-record")).to_contain_text("404")


def test_the_sound_can_be_tried_and_only_the_chime_switched_off(
    open_page: OpenPage,
) -> None:
    page = open_page(route="/settings")
    # The page says how its sound is once it is wired.
    expect(page.locator("#sound-state")).not_to_be_empty()

    page.locator("#sound-test").click()
    expect(page.locator("#sound-state")).to_contain_text("Sonando")
    page.locator("#sound-others").uncheck()
    page.reload()

    expect(page.locator("#sound-others")).not_to_be_checked()


def test_the_fleet_page_tells_how_the_fleet_obeys_with_age_and_count(
    open_page: OpenPage,
) -> None:
    page = open_page(360, 800, route="/fleet")

    for tile in ("echo", "negative", "worst"):
        place = page.locator(f"#tile-{tile}")
        expect(place).to_contain_text(re.compile(r"\d"))
        expect(page.locator(f"#tile-{tile}-of")).to_contain_text("hace")
    assert evaluate(page, OVERFLOW) <= 0
    assert serious(page) == []


def test_an_operator_changes_the_rule_and_sees_its_version(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(390, 844, route="/settings")
    radius = page.locator("#rule-new-radius")
    expect(radius).to_have_value("2")
    before = int(page.locator("#rule-version").inner_text())

    radius.fill("2.5")
    page.locator("#rule-form button[type=submit]").click()

    expect(page.locator("#rule-radius")).to_have_text("2,5 m")
    expect(page.locator("#rule-version")).to_have_text(str(before + 1))
    expect(page.locator("#rule-note")).to_contain_text("por operador")
    with stack.api() as api:
        assert api.get("rule").json()["radius_m"] == 2.5


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
    page.locator("#class-person").fill("70")
    page.locator("#class-save").click()

    expect(page.locator("#class-result")).to_contain_text(f"versión {before + 1}")
    expect(page.locator("#rule-version")).to_have_text(str(before + 1))
    with stack.api() as api:
        rule = api.get("rule").json()
    assert rule["aliases"]["tractor"] == "robot"
    assert rule["class_thresholds"] == {"person": 0.7}
    page.reload()
    expect(words.filter(has_text="tractor")).to_contain_text("robot")

    words.filter(has_text="tractor").locator("button").click()
    page.locator("#class-person").fill("")
    page.locator("#class-save").click()
    # 13.14: fewer people would count, so it takes a second word and can be undone.
    expect(page.locator("#guard-says")).to_contain_text("ya no frenaría")
    expect(page.locator("#rule-version")).to_have_text(str(before + 1))
    page.locator("#guard-yes").click()
    expect(page.locator("#rule-version")).to_have_text(str(before + 2))
    expect(page.locator("#rule-undo")).to_contain_text("Deshacer")
    expect(words.filter(has_text="tractor")).to_have_count(0)


def test_a_word_in_markup_is_text_on_the_settings_page(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(route="/settings")
    expect(page.locator("#class-save")).to_be_visible()

    page.locator("#alias-word").fill(PROBE)
    page.locator("#alias-add").click()
    expect(page.locator("#aliases")).to_contain_text("<img")
    page.locator("#class-save").click()

    # The server keeps what the wire allows of it.
    expect(page.locator("#class-result")).to_contain_text("versión")
    expect(page.locator("#aliases")).to_contain_text("img src")
    assert page.locator("img[src=x]").count() == 0
    assert evaluate(page, "() => window.probed ?? null") is None


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


def test_a_new_rule_is_seen_in_every_browser_at_once(open_page: OpenPage) -> None:
    about, settings = open_page(route="/about"), open_page(route="/settings")
    writer = open_page(route="/settings")
    expect(writer.locator("#rule-new-radius")).not_to_have_value("")
    expect(settings.locator("#rule-new-radius")).not_to_have_value("")

    writer.locator("#rule-new-radius").fill("3.4")
    writer.locator("#rule-form button[type=submit]").click()

    soon = 5000.0
    expect(settings.locator("#rule-radius")).to_have_text("3,4 m", timeout=soon)
    expect(settings.locator("#rule-new-radius")).to_have_value("3.4", timeout=soon)
    expect(about.locator("#about-rule")).to_contain_text("3,4 m", timeout=soon)


@pytest.mark.parametrize("width", [390, 1440])
def test_signing_out_ends_the_session(
    open_page: OpenPage, stack: Site, width: int
) -> None:
    page = open_page(width, 900, route="/about", alone=True)
    page.wait_for_selector("#sign-out:not([disabled])", state="attached")
    page.locator("[data-opens=menu]:visible").first.click()

    page.locator("#sign-out").click()

    page.wait_for_url("**/signin")
    assert page.locator("[data-stop]").count() == 0
    answer = page.request.get(f"{stack.url}/api/v1/robots", max_retries=AGAIN)
    assert answer.status == 401


def test_markup_in_a_note_is_text_on_every_page(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(768, 1024, route="/alerts")
    with _frozen(stack, "emulator"):
        # One that is over goes with its note as soon as it was seen.
        over = page.locator("small", has_text="terminada")
        row = page.locator("#active-alerts > li:not(:has(form[hidden]))", has_not=over)
        row.first.wait_for()
        # It is not the first any more once further alerts have come before it.
        row.first.evaluate("row => { row.id = 'noted'; row.firstChild.open = true; }")

        page.locator("#noted input").fill(PROBE)
        page.locator("#noted form:not(.notes__form) button").click()

        page.locator("#active-alerts", has_text=PROBE).wait_for()
    noted = page.locator("#past-rows td", has_text="operador")
    expect(noted.first).to_be_visible()
    assert page.locator("img[src=x]").count() == 0
    assert evaluate(page, "() => window.probed ?? null") is None


def _serious_in(page: Page, theme: str) -> list[str]:
    """All rules in the first theme; in the others the one whose answer may differ."""
    script = "([theme]) => { document.documentElement.dataset.theme = theme; }"
    evaluate(page, script, theme)
    return serious(page, *([] if theme == THEMES[0] else ["color-contrast"]))


def _newest_decision(stack: Site) -> str | None:
    with stack.api() as api:
        items = api.get("decisions", params={"limit": 1}).json()["items"]
    return str(items[0]["decision_id"]) if items else None


def _detection(class_id: str) -> dict[str, Any]:
    corners = {"xmin": 3, "xmax": 3.5, "ymin": 3, "ymax": 3.5, "zmin": 0, "zmax": 1}
    return {
        "bounding_boxes": {
            "class_id": class_id,
            "probability": 0.99,
            "position": corners,
            "frame_id": "map",
        }
    }


def _publish(stack: Site, robot: str, payload: dict[str, Any]) -> None:
    broker = BrokerAddress.from_url(stack.settings["IVEG_MQTT_URL"])
    topic = f"/iveg/{robot}_yolox_bounding_boxes/attrs"
    text = json.dumps(payload)
    publish.single(topic, text, qos=1, hostname=broker.host, port=broker.port)


@contextmanager
def _frozen(stack: Site, word: str) -> Iterator[None]:
    """A program that is there and does nothing."""
    (program,) = (one for one in stack.programs if one.words[0] == word)
    program.process.send_signal(signal.SIGSTOP)
    try:
        yield
    finally:
        program.process.send_signal(signal.SIGCONT)
