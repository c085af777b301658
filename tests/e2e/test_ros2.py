"""The five widgets before the robots of ``demo --ros2``."""

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Page, expect

from iveg.lab.commands.demo import ros2_parts
from tests.e2e.conftest import OpenPage
from tests.e2e.hands import let_go
from tests.e2e.reading import (
    HALVED,
    STANDING,
    card,
    number,
    strip_stop,
    wait_for_paintings,
)
from tests.processes import Site, site, until

pytestmark = [pytest.mark.e2e]


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with site(tmp_path_factory.mktemp("ros2")) as place:
        place.start("fiware").wait_until_ready()
        place.start("serve", "--demo").wait_until_ready()
        emulator, *robots = ros2_parts(["AGI", "AGII"])
        place.start(*emulator, "--hz", "10")
        for words in robots:
            place.start(*words)
        place.wait_until_live()
        yield place


def test_over_ros_2_each_of_the_five_widgets_does_its_work(
    open_page: OpenPage, stack: Site, shoot: Callable[[Page, str], None]
) -> None:
    page = open_page()
    page.wait_for_selector('[data-robot="AGI"][data-link="LIVE"]')
    x, y = number(page, "AGI", "x"), number(page, "AGI", "y")

    def moves() -> bool:
        far = abs(number(page, "AGI", "x") - x) + abs(number(page, "AGI", "y") - y)
        return far > 0.2 and number(page, "AGI", "v") > 0.05

    wait_for_paintings(page, "AGI", "AGII")
    until(moves, "pose and speed of AGI change")
    page.locator('#log [data-kind="speed"]', has_text=HALVED).first.wait_for()
    shoot(page, "ros2-live")
    strip_stop(page, "AGI").click()
    expect(strip_stop(page, "AGI")).to_contain_text(STANDING, timeout=10_000)
    expect(card(page, "AGI")).to_have_attribute("data-mode", "STOPPED")
    shoot(page, "ros2-stopped")
    let_go(page, stack, "AGI")
    until(moves, "AGI drives again")
    stack.assert_clean()
