"""The five widgets before the robots of ``demo --ros2``."""

import re
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Page, expect

from iveg.lab.commands.demo import ros2_parts
from tests.e2e.conftest import OpenPage
from tests.e2e.hands import let_go
from tests.e2e.reading import card, evaluate, number, strip_stop
from tests.processes import Site, site, until

pytestmark = [pytest.mark.e2e]

NOTE_PAINTED = """() => {
  window.painted = {};
  window.__onPaint = ({robot, kind, stamp}) => {
    const key = `${robot} ${kind}`;
    (window.painted[key] ??= new Set()).add(stamp);
  };
}"""
HALVED = re.compile(r"50\W?%: .*(?:persona|robot)")
STANDING = re.compile(r"PARADO \(hace [\d,]+ s\)")


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
    evaluate(page, NOTE_PAINTED)
    x, y = number(page, "AGI", "x"), number(page, "AGI", "y")

    def moves() -> bool:
        far = abs(number(page, "AGI", "x") - x) + abs(number(page, "AGI", "y") - y)
        return far > 0.2 and number(page, "AGI", "v") > 0.05

    for key in ("AGI odom", "AGI lidar", "AGII odom", "AGII lidar"):
        page.wait_for_function("key => window.painted[key]?.size > 30", arg=key)
    until(moves, "pose and speed of AGI change")
    page.locator('#log [data-kind="speed"]', has_text=HALVED).first.wait_for()
    shoot(page, "ros2-live")
    strip_stop(page, "AGI").click()
    expect(strip_stop(page, "AGI")).to_contain_text(STANDING, timeout=10_000)
    expect(card(page, "AGI")).to_have_attribute("data-mode", "STOPPED")
    shoot(page, "ros2-stopped")
    let_go(page, stack, "AGI")
    until(moves, "AGI drives again")


def test_the_logs_of_every_part_are_clean(stack: Site) -> None:
    stack.assert_clean()
