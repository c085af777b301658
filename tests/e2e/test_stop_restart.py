"""iVeg dies and comes back, sessions end: the open page can still stop."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from playwright.sync_api import Page, expect

from iveg.adapters.access_file import AccessFile
from tests.e2e.conftest import OpenPage
from tests.e2e.hands import let_go, open_menu
from tests.e2e.puppet import CRUISE, Puppet, stage
from tests.e2e.reading import card, strip_stop
from tests.processes import Site, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow]

HOUR = 3600.0


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Site, Puppet]]:
    with stage(tmp_path_factory.mktemp("restart")) as found:
        yield found


@pytest.fixture(scope="module")
def stack(scene: tuple[Site, Puppet]) -> Site:
    return scene[0]


@pytest.fixture
def page(open_page: OpenPage) -> Page:
    """A browser that rightly says when the server is gone."""
    found = open_page(alone=True)
    found.wait_for_selector('[data-robot="AGV"][data-link="LIVE"]')
    return found


@pytest.fixture
def agv(scene: tuple[Site, Puppet], page: Page, stack: Site) -> Puppet:
    """The robot, driving and obedient."""
    robot = scene[1]
    robot.behave()
    let_go(page, stack, "AGV")
    robot.speed = CRUISE
    return robot


def test_a_press_while_the_server_is_dead_arrives_and_the_page_recovers_by_itself(
    page: Page, agv: Puppet, stack: Site
) -> None:
    stack.newest("serve").kill()
    control = strip_stop(page, "AGV")
    expect(page.locator("#status")).to_contain_text("Sin conexión")
    expect(control).to_have_attribute("data-state", "lost")
    control.click()
    _serve_again(stack)

    expect(control).to_contain_text("PARADO (")
    assert agv.speed == 0.0
    let_go(page, stack, "AGV")
    expect(control).to_have_attribute("data-state", "ready")


def test_f42_a_page_whose_session_is_over_stops_and_asks_to_sign_in_for_the_rest(
    page: Page, agv: Puppet, stack: Site
) -> None:
    stack.newest("serve").kill()
    _age_sessions(stack, 13 * HOUR)
    _serve_again(stack)

    control = strip_stop(page, "AGV")
    expect(control).to_contain_text("PARAR AGV (sesión terminada)")
    expect(page.locator("#status")).to_contain_text("La sesión ha terminado")
    control.click()

    expect(control).to_contain_text("Orden entregada: mire el robot o entre de nuevo")
    until(lambda: agv.speed == 0.0, "the robot stands")
    open_menu(page, "AGV")
    why = card(page, "AGV").locator('[data-part="release-why"]')
    expect(why).to_have_text("La sesión ha terminado: entre de nuevo para rearmar.")
    expect(page.locator('[data-release="AGV"]')).to_be_disabled()
    page.goto(stack.printed_link)
    expect(strip_stop(page, "AGV")).to_contain_text("PARADO")


def _serve_again(stack: Site) -> None:
    stack.start("serve")
    stack.wait_until_served()


def _age_sessions(stack: Site, seconds: float) -> None:
    """As if that much time had gone by while iVeg was away."""
    file = AccessFile(stack.directory / "accounts.jsonl")
    known = file.load()
    aged = (replace(one, began=one.began - seconds) for one in known.sessions)
    file.save(replace(known, sessions=tuple(aged)))
    file.close()
