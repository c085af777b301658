"""A drill from the card of a robot to the sheet that somebody signs."""

import hashlib
import re
import secrets
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from iveg.adapters.sessions import FileSessions, Session
from tests.e2e.conftest import OpenPage
from tests.e2e.hands import let_go, look, open_menu
from tests.e2e.puppet import CRUISE, Puppet, stage
from tests.e2e.reading import OVERFLOW, card, serious, strip_stop
from tests.patience import AGAIN
from tests.processes import Site, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow]

VIEWER = secrets.token_urlsafe(32)
_TWO_SECONDS = str(2 / 86_400)
"""Drills are due this soon (days)."""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Site, Puppet]]:
    directory = tmp_path_factory.mktemp("drills")
    _let_in(directory, "Ana", "viewer", VIEWER)
    with stage(directory, IVEG_DRILL_DAYS=_TWO_SECONDS) as found:
        yield found


@pytest.fixture(scope="module")
def stack(scene: tuple[Site, Puppet]) -> Site:
    return scene[0]


@pytest.fixture
def page(open_page: OpenPage) -> Page:
    found = open_page()
    found.wait_for_selector('[data-robot="AGV"][data-link="LIVE"]')
    return found


@pytest.fixture
def agv(scene: tuple[Site, Puppet], page: Page, stack: Site) -> Puppet:
    """The robot, free and at rest."""
    robot = scene[1]
    robot.behave()
    let_go(page, stack, "AGV")
    robot.speed = 0.0
    return robot


def test_a_drill_is_one_tap_and_ends_with_its_time_in_the_history(
    page: Page, agv: Puppet, stack: Site
) -> None:
    open_menu(page, "AGV")
    panel = card(page, "AGV").locator("dialog")
    why = panel.locator('[data-part="drill-why"]')
    expect(why).to_have_text("Está parado o casi: se puede hacer.")
    panel.locator('[data-drill="AGV"]').click()

    result = panel.locator('[data-part="drill-result"]')
    expect(result).to_have_text(
        re.compile(r"Superado: parado en \d+ ms\. Sigue parado: rearme y reanude\.")
    )
    expect(why).to_have_text("Ya tiene una parada: primero rearme y reanude.")
    expect(panel.locator('[data-part="drill-last"]')).to_have_text(
        re.compile(r"El último: [\d/]+ [\d:]+, por operador\. Superado")
    )
    assert agv.holds == [look(page, stack, "AGV")["stop"]["command_id"]]
    with stack.api() as api:
        drill = api.get("drills", params={"robot": "AGV"}).json()["items"][0]
    assert drill["command_id"] == agv.holds[0]
    assert drill["passed"] is True
    assert "direct" in drill["command"]["times"]["answer"]


def test_a_robot_that_drives_is_not_drilled_and_the_control_says_why(
    page: Page, agv: Puppet
) -> None:
    agv.speed = CRUISE
    open_menu(page, "AGV")

    expect(card(page, "AGV").locator('[data-part="drill-why"]')).to_have_text(
        "Va demasiado deprisa: espere a que esté parado o no pase de 0,2 m/s."
    )
    expect(page.locator('[data-drill="AGV"]')).to_be_disabled()


def test_a_robot_that_does_not_brake_fails_its_drill(page: Page, agv: Puppet) -> None:
    agv.brakes, agv.speed = False, 0.15
    open_menu(page, "AGV")
    page.locator('[data-drill="AGV"]').click()

    result = card(page, "AGV").locator('[data-part="drill-result"]')
    expect(result).to_contain_text("Fallido: en 5 s no se comprobó que se parase.")
    expect(card(page, "AGV").locator('[data-field="mode"]')).to_have_text(
        "Parada recibida pero se mueve"
    )
    agv.brakes = True
    expect(strip_stop(page, "AGV")).to_have_attribute("data-state", "standing")


@pytest.mark.usefixtures("agv")
def test_the_sheet_of_drills_prints_with_the_honest_sentence_and_a_line_to_sign(
    page: Page, stack: Site, shoot: Callable[[Page, str], None]
) -> None:
    page.goto(f"{stack.url}/commands")
    line = page.locator('[data-drills-of="AGV"]')
    expect(line).to_contain_text(re.compile(r"Fallido: tardó \d[\d.]* ms"))
    expect(line).to_contain_text("toca simulacro de parada")
    assert serious(page) == []

    page.emulate_media(media="print")

    sheet = page.locator(".print-only")
    expect(sheet).to_contain_text("No es una parada de emergencia ni está certificado")
    expect(sheet).to_contain_text("Nombre y firma:")
    expect(page.locator("#stops")).to_be_hidden()
    shoot(page, "drills-on-paper")


@pytest.mark.usefixtures("agv")
def test_a_viewer_sees_no_drill_to_press_and_may_stop(
    open_page: OpenPage, stack: Site
) -> None:
    viewer = open_page(390, 844, alone=True)
    cookie = {"name": "iveg", "value": VIEWER, "url": stack.url}
    viewer.context.add_cookies([cookie])  # type: ignore[list-item]
    viewer.goto(stack.url)
    viewer.wait_for_selector('[data-robot="AGV"][data-link="LIVE"]')
    open_menu(viewer, "AGV")

    expect(card(viewer, "AGV").locator('[data-part="drill-why"]')).to_have_text(
        "Solo un operador puede hacer un simulacro."
    )
    expect(viewer.locator('[data-drill="AGV"]')).to_be_disabled()
    assert viewer.evaluate(OVERFLOW) <= 0
    asked = viewer.request.post(
        f"{stack.url}/api/v1/robots/AGV/drill",
        headers={"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"},
        max_retries=AGAIN,
    )
    assert asked.status == 403
    viewer.keyboard.press("Escape")
    viewer.locator('[data-stop="AGV"]:visible').first.click()
    until(
        lambda: look(viewer, stack, "AGV")["stop_state"] == "STANDING",
        "the viewer's STOP stands",
    )


def _let_in(directory: Path, name: str, role: str, token: str) -> None:
    """A session that was begun before iVeg starts."""
    now = time.time()
    digest = hashlib.sha256(token.encode()).hexdigest()
    store = FileSessions(directory / "sessions.jsonl")
    store.save([Session(digest, name, role, now, now)])
    store.close()
