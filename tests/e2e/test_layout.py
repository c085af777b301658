"""Where things stand on the live page, at every size, with two, three and six robots.

The robots are those of a snapshot (``tests.e2e.frozen``): nothing moves while it is
measured, and each fleet has one page for all sizes.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, WebSocketRoute, expect

from tests import staged
from tests.e2e.frozen import Frozen, frozen, frozen_page, past_site, settle
from tests.e2e.reading import (
    COVERED_STOPS,
    CUT_HEADER,
    OVERFLOW,
    SMALLEST_STOP,
    TABLET,
    evaluate,
    strip_stop,
)
from tests.processes import Site
from tests.staged import STAGED

pytestmark = pytest.mark.e2e

APART_PX = 24
DESKTOPS = ((1200, 800), (1440, 900), (1500, 900), (1920, 1080))
OTHERS = ((1024, 768), (844, 390), (667, 375), (768, 1024), (390, 844), (360, 740))
SIZES = (*DESKTOPS, *OTHERS)


@dataclass
class Fleet:
    """The live page of so many robots."""

    page: Page
    lines: list[WebSocketRoute] = field(default_factory=list)

    def at(self, size: tuple[int, int]) -> Page:
        """The page in a window of this size."""
        self.page.set_viewport_size({"width": size[0], "height": size[1]})
        self.page.clock.run_for(250)
        return self.page

    def tell(self, robot: dict[str, Any]) -> None:
        """A robot's state changes."""
        topic = f"robots/{robot['robot_id']}"
        self.lines[-1].send(json.dumps({"topic": topic, "data": robot}))
        self.page.evaluate("() => fetch('/healthz')")
        self.page.clock.run_for(500)


def snapshot(count: int) -> Frozen:
    """The snapshot with more robots like the first two."""
    told = frozen()
    robots = told["snapshot"]["robots"]
    for n in range(count - len(robots)):
        robots.append({**robots[n % 2], "robot_id": f"R{n + 3}"})
    return told


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server that has no robots."""
    with past_site(tmp_path_factory.mktemp("layout")) as place:
        yield place


@pytest.fixture(scope="module", params=[2, 3, 6], ids="{} robots".format)
def fleet(
    request: pytest.FixtureRequest, browser: Browser, past: Site
) -> Iterator[Fleet]:
    """A page on it that hears of so many."""
    told = snapshot(request.param)
    lines: list[WebSocketRoute] = []
    size = (1440, 900)
    with frozen_page(browser, past, size, tell=lambda: told, lines=lines) as page:
        page.goto(past.url)
        settle(page, "#map-fit:enabled")
        yield Fleet(page, lines)


def test_13_19_nothing_overflows_or_covers_a_stop_and_stops_stand_apart(
    fleet: Fleet,
) -> None:
    wanted = {
        "overflow": 0,
        "covered": [],
        "apart": True,
        "large": True,
        "header": [],
        "tags": [],
    }
    for size in SIZES:
        page = fleet.at(size)
        found = {
            "overflow": evaluate(page, OVERFLOW),
            "covered": evaluate(page, COVERED_STOPS),
            "apart": evaluate(page, NEAREST_STOP) >= APART_PX,
            "large": evaluate(page, SMALLEST_STOP) >= 64,
            "header": evaluate(page, COLLISIONS),
            "tags": evaluate(page, TAGS_ON_WORDS),
        }
        assert found == wanted, size


@pytest.mark.parametrize("fleet", [2], indirect=True)
def test_13_4_the_navigation_has_every_entry_on_every_desktop(fleet: Fleet) -> None:
    for size in DESKTOPS:
        page = fleet.at(size)
        entries = page.locator(".nav a").all()
        assert len(entries) == page.locator(".menu a").count() > 0
        for entry in entries:
            expect(entry).to_be_in_viewport(ratio=1)


@pytest.mark.parametrize("fleet", [2], indirect=True)
def test_13_4_the_user_opens_a_menu_with_a_way_out(fleet: Fleet) -> None:
    for size in ((1920, 1080), (1024, 768), (844, 390)):
        page = fleet.at(size)
        page.locator(".header [data-opens=menu]:visible").first.click()

        page.locator("#sign-out").scroll_into_view_if_needed()
        expect(page.locator("#sign-out")).to_be_in_viewport(ratio=1)
        assert evaluate(page, COVERED_STOPS) == []
        page.keyboard.press("Escape")


@pytest.mark.parametrize("fleet", [2], indirect=True)
def test_13_19_a_low_screen_is_mostly_map(fleet: Fleet) -> None:
    for size, high in (((1024, 768), 520), ((844, 390), 300), ((667, 375), 285)):
        box = fleet.at(size).locator("#map").bounding_box()
        assert box is not None
        assert box["height"] >= high, size


@pytest.mark.parametrize("fleet", [2, 6, 10], indirect=True)
def test_a_tablet_shows_the_strip_of_time_above_the_stops(fleet: Fleet) -> None:
    border_px = 1
    for size in ((768, 1024), (820, 1180), (1024, 1366), (1024, 768), (1180, 820)):
        page = fleet.at(size)
        strip = page.locator(".timebar").bounding_box()
        stops = page.locator("#stops").bounding_box()
        assert strip is not None
        assert stops is not None
        assert strip["y"] + strip["height"] <= stops["y"] + border_px, size
        assert evaluate(page, UNREACHABLE, ".timebar") == [], size


UNREACHABLE = """([within]) => [...document.querySelectorAll(
  `${within} :is(a, button, svg[tabindex], time)`)]
  .filter((one) => one.checkVisibility())
  .flatMap((one) => {
    const {left, right, top, bottom} = one.getBoundingClientRect();
    const corners = [[left, top], [right, top], [left, bottom], [right, bottom]];
    return corners.map(([x, y]) => [one, x < right ? x + 2 : x - 2,
      y < bottom ? y + 2 : y - 2]);
  })
  .filter(([one, x, y]) => !one.contains(document.elementFromPoint(x, y)))
  .map(([one, x, y]) => `${one.id || one.className} at ${x}, ${y}`)"""
"""Corners of what can be pressed or read where something else lies over it."""

SAID = """() => {
  const said = document.querySelector('#status-said');
  const size = (of) => parseFloat(getComputedStyle(of).fontSize)
    * (of.getScreenCTM?.().a ?? 1);
  const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const larger = [];
  while (words.nextNode()) {
    const of = words.currentNode.parentElement;
    if (!words.currentNode.data.trim() || !of.checkVisibility()) continue;
    const isOther = of.closest('.stop, #status, .visually-hidden');
    if (!isOther && size(of) > size(said)) larger.push(of.textContent);
  }
  const box = document.querySelector('#status').getBoundingClientRect();
  const stop = document.querySelector('#stops [data-stop="fleet"]');
  const {x, y} = stop.getBoundingClientRect();
  return {
    stop: stop.checkVisibility() ? [x, y] : [],
    first: box.top === 0, whole: said.scrollHeight <= box.height,
    larger, high: box.height,
    long: document.querySelector('#status').hasAttribute('data-long'),
  };
}"""
"""The status line: where it stands, whether it fits, and whether no text is larger; and
where the STOP of all is."""


@pytest.mark.parametrize("fleet", [2], indirect=True)
def test_the_status_line_is_first_and_largest_and_nothing_moves(fleet: Fleet) -> None:
    first = frozen()["snapshot"]["robots"][0]
    places: dict[tuple[int, int], set[tuple[float, ...]]] = {
        one: set() for one in SIZES
    }
    for name, (known, *_) in STAGED.items():
        fleet.tell({**first, "situation": staged.told(known), "age_s": known.age_s})
        fleet.page.clock.run_for(1500)
        for size in SIZES:
            page = fleet.at(size)
            found = evaluate(page, SAID)
            assert (found["first"], found["whole"]) == (True, True), (size, name)
            is_small = size[0] < 400 and found["long"]
            assert found["larger"] == [] or is_small, (size, name)
            x, y = found["stop"]
            places[size].add((found["high"], x, y))
    assert [size for size in SIZES if len(places[size]) != 1] == []


@pytest.mark.parametrize("fleet", [2], indirect=True)
def test_the_status_line_shows_its_robot_on_the_map_by_tap_and_by_key(
    fleet: Fleet,
) -> None:
    first = frozen()["snapshot"]["robots"][0]
    danger = staged.told(STAGED["STOP not confirmed"][0])
    fleet.tell({**first, "situation": danger, "age_s": 0.0})
    page = fleet.at((1440, 900))
    following = page.locator("#following")

    for _ in range(2):
        page.locator("#map-fit").click()
        expect(following).to_be_hidden()
        page.locator("#status").click()
        expect(following).to_contain_text("AGI")
        assert page.url.endswith("/")
    page.locator("#map-fit").click()
    page.locator("#status").press("Enter")
    expect(following).to_contain_text("AGI")
    fleet.tell({**first, "situation": staged.told(staged.facts()), "age_s": 0.0})


HELD = {"mode": "STOPPED", "holds": [{"id": "x", "source": "hw", "ack": "local"}]}
SILENT = {"pose": None, "twist": None, "applied": None, "age_s": None}
STATES: tuple[dict[str, Any], ...] = (
    {},
    {"margin": None, "navigation": None},
    HELD,
    {"mode": "SLOW", "twist": {"linear": 0.0, "angular": 0.0}},
    SILENT,
)


@pytest.mark.parametrize("fleet", [2], indirect=True)
def test_13_19_a_card_is_as_high_whatever_it_says(fleet: Fleet) -> None:
    first = frozen()["snapshot"]["robots"][0]
    for size in ((1440, 900), (1024, 768), (768, 1024), (390, 844)):
        heights = set()
        for state in STATES:
            fleet.tell({**first, **state})
            heights.add(evaluate(fleet.at(size), CARD_HEIGHT))
        assert len(heights) == 1, size


@pytest.mark.parametrize("fleet", [2, 6], indirect=True)
def test_a_card_shows_no_half_line_and_what_to_do_whole(fleet: Fleet) -> None:
    first = frozen()["snapshot"]["robots"][0]
    cut = {}
    for name, (known, *_) in STAGED.items():
        fleet.tell({**first, "situation": staged.told(known), "age_s": known.age_s})
        for size in (*SIZES, (1280, 900)):
            found = evaluate(fleet.at(size), CUT_LINES)
            if found:
                cut[name, size] = found
    fleet.tell(first)

    assert cut == {}


LONG = (
    "half speed",
    "half speed for a memory",
    "too close to where somebody was",
    "something that only a laser sees",
    "a camera is silent",
)
"""Situations of which there is most to say."""


@pytest.mark.parametrize("fleet", [6], indirect=True)
@pytest.mark.parametrize(
    "size", [(1200, 800), (1440, 900), (1024, 768), (390, 844), (360, 740)]
)
def test_a_small_card_says_whole_what_it_is_because_of(
    fleet: Fleet, size: tuple[int, int]
) -> None:
    first = frozen()["snapshot"]["robots"][0]
    card = fleet.at(size).locator('.card[data-robot="AGI"]')
    cut = set()
    for name in LONG:
        known = STAGED[name][0]
        told = {**first, "situation": staged.told(known), "age_s": known.age_s}
        fleet.tell(told)
        fleet.page.clock.run_for(1000)  # The cards find their order.
        fleet.tell(told)
        # Else it would say how late it is.
        expect(card).to_have_attribute("data-link", "LIVE")
        if evaluate(fleet.page, CUT_SAID):
            cut.add(name)
    fleet.tell(first)

    assert cut == set()


@pytest.mark.parametrize("fleet", [2], indirect=True)
def test_two_cards_are_whole_on_a_desktop_and_have_no_second_stop(fleet: Fleet) -> None:
    page = fleet.at((1440, 900))

    for robot in ("AGI", "AGII"):
        last = page.locator(f'[data-robot="{robot}"] [data-part="margin"]')
        expect(last).to_be_in_viewport(ratio=1)
        expect(page.locator(f'[data-stop="{robot}"]:visible')).to_have_count(1)


@pytest.mark.parametrize("fleet", [2, 6], indirect=True)
def test_a_card_has_three_sizes_of_letters(fleet: Fleet) -> None:
    for size in SIZES:
        found = evaluate(fleet.at(size), LETTERS)
        assert len(found) <= 3, (size, found)


@pytest.mark.parametrize("fleet", [2], indirect=True)
def test_the_menu_of_a_recorded_robot_is_on_its_card(fleet: Fleet) -> None:
    first = frozen()["snapshot"]["robots"][0]
    fleet.tell({**first, "replay": True})
    card = fleet.at((1440, 900)).locator(".card").first.bounding_box()
    menu = fleet.page.locator(".card__menu").first.bounding_box()
    fleet.tell(first)
    assert card is not None
    assert menu is not None
    assert menu["x"] + menu["width"] <= card["x"] + card["width"]


@pytest.mark.parametrize("fleet", [6], indirect=True)
def test_13_19_the_stop_of_each_of_six_robots_is_in_sight(fleet: Fleet) -> None:
    for size in ((1200, 800), (1440, 900), (1024, 768), (768, 1024)):
        stops = fleet.at(size).locator(".card .stop").all()

        assert len(stops) == 6
        for stop in stops:
            expect(stop).to_be_in_viewport(ratio=1)


@pytest.mark.parametrize("fleet", [2, 6], indirect=True)
def test_13_19_a_cards_stop_keeps_its_distance_however_it_is_scrolled(
    fleet: Fleet,
) -> None:
    near = [_within_reach(fleet.at(size)) for size in OTHERS]

    assert near == [[] for _ in OTHERS]


def _within_reach(page: Page) -> object:
    """Which STOPs are, once the page has measured itself in its new window."""
    for _ in range(50):
        near = evaluate(page, WITHIN_REACH)
        if not near:
            break
        page.clock.run_for(100)
    return near


WITHIN_REACH = """() => {
  const all = document.querySelector('#stops [data-stop="fleet"]');
  const near = new Set();
  const isNear = ([x, y], box) => x > box.left - 24 && x < box.right + 24
    && y > box.top - 24 && y < box.bottom + 24;
  for (const stop of document.querySelectorAll('.card .stop')) {
    if (!stop.checkVisibility({visibilityProperty: true})) continue;
    for (const into of [8, 40]) {
      const box = all.getBoundingClientRect();
      scrollBy(0, stop.getBoundingClientRect().bottom - box.top - into);
      for (let px = 1; px < 24; px += 2) {
        const side = [box.left - px, stop.getBoundingClientRect().top + 4];
        const above = [stop.getBoundingClientRect().left + 20, box.top - px];
        for (const [x, y] of [above, side].filter((it) => isNear(it, box))) {
          const hit = document.elementFromPoint(x, y);
          if (hit && stop.contains(hit)) near.add(`${stop.dataset.stop} ${px}`);
        }
      }
    }
  }
  scrollTo(0, 0);
  return [...near];
}"""
"""STOPs of cards that a finger finds within 24 px of that of all, when scrolled."""
CUT_LINES = """() => {
  const card = document.querySelector('.card[data-robot="AGI"]');
  const mode = card.querySelector('.card__mode');
  const words = document.createTreeWalker(mode, NodeFilter.SHOW_TEXT);
  const found = [];
  const said = card.querySelector('.card__said');
  const lines = parseInt(getComputedStyle(said).webkitLineClamp);
  const high = lines * parseFloat(getComputedStyle(said).lineHeight);
  if (said.scrollHeight > said.clientHeight + 1 && said.clientHeight < high - 1)
    found.push(`without an ellipsis: ${said.textContent}`);
  while (words.nextNode()) {
    const node = words.currentNode;
    const isTodo = Boolean(node.parentElement.closest('.card__todo'));
    const range = document.createRange();
    range.selectNodeContents(node);
    const bottoms = [node.parentElement.closest('.card__said'), mode]
      .filter((of) => of && getComputedStyle(of).overflow === 'hidden')
      .map((of) => of.getBoundingClientRect().bottom);
    for (const line of node.data.trim() ? range.getClientRects() : []) {
      const seen = Math.min(line.bottom, ...bottoms) - line.top;
      const isWhole = seen > line.height - 3;
      if (!isWhole && (seen > 2 || isTodo)) found.push(`${node.data}: ${seen} px`);
    }
  }
  return found;
}"""
"""Lines of a card that are seen in part or cut without an ellipsis, and what to do that
is not seen."""
CUT_SAID = """() => {
  const said = document.querySelector('.card[data-robot="AGI"] .card__said');
  return said.scrollHeight > said.clientHeight + 1;
}"""
LETTERS = """() => {
  const words = document.createTreeWalker(
    document.querySelector('#robots'), NodeFilter.SHOW_TEXT);
  const sizes = new Set();
  while (words.nextNode()) {
    const of = words.currentNode.parentElement;
    if (!words.currentNode.data.trim() || !of.checkVisibility()) continue;
    if (!of.closest('.stop, svg, dialog')) sizes.add(getComputedStyle(of).fontSize);
  }
  return [...sizes];
}"""
"""Sizes of the letters on cards, but those of STOP and of the gauge, which scales."""
CARD_HEIGHT = """() => {
  const box = (part) => document.querySelector(`[data-robot="AGI"] ${part}`)
    .getBoundingClientRect();
  const bottom = (part) => box(`[data-part="${part}"]`).bottom;
  const last = Math.max(bottom('task'), bottom('margin'));
  return Math.round(last - box('.card__head').top);
}"""
"""From the head of a card to its last line (px); a phone has a STOP below."""
NEAREST_STOP = """() => {
  const boxes = [...document.querySelectorAll('[data-stop]')]
    .filter((stop) => stop.checkVisibility({visibilityProperty: true}))
    .map((stop) => [stop.dataset.stop, stop.getBoundingClientRect(),
      Boolean(stop.closest('#stops'))]);
  const [, all] = boxes.find(([id]) => id === 'fleet');
  const gaps = boxes.filter(([id, , strip]) => id !== 'fleet' && strip)
    .map(([, box]) => Math.max(
      all.left - box.right, box.left - all.right,
      all.top - box.bottom, box.top - all.bottom));
  return gaps.length ? Math.min(...gaps) : 1000;
}"""
"""The gap (px) between the STOP of all and the nearest other of the strip."""
COLLISIONS = """() => {
  const parts = [...document.querySelectorAll('.header__bar > *')]
    .filter((part) => !part.matches('.stops, .spring') && part.checkVisibility());
  const boxes = parts.map((part) => [part.className, part.getBoundingClientRect()]);
  return boxes.slice(1).filter(([, box], i) => box.left < boxes[i][1].right - 1)
    .map(([name]) => name);
}"""
"""Parts of the header that lie on the one before."""


@pytest.mark.parametrize("fleet", [2, 6], indirect=True)
def test_a_phone_has_one_card_a_swipe_the_worst_first_and_none_moves_once_swiped(
    fleet: Fleet,
) -> None:
    told = frozen()["snapshot"]["robots"][0]
    page = fleet.at((390, 844))
    row = page.locator("#robots")
    row.evaluate("(row) => { scrollTo(0, 0); row.scrollLeft = 0; }")
    last = page.locator(".card").last
    danger = {**told["situation"], "level": "danger", "state": "unconfirmed"}
    worst = {**told, "robot_id": last.get_attribute("data-robot"), "situation": danger}

    fleet.tell({**worst, "age_s": 0.0})
    page.clock.run_for(1500)
    first = page.locator(".card").first
    expect(first).to_have_attribute("data-robot", worst["robot_id"])
    expect(first.locator(".stop")).to_be_in_viewport(ratio=1)
    assert row.evaluate("(row) => row.scrollLeft") == 0

    page.locator(".card .card__menu").last.focus()
    expect(page.locator(".card .card__menu").last).to_be_in_viewport(ratio=1)
    page.locator(".card .card__menu").last.blur()
    swiped = row.evaluate("(row) => row.scrollLeft")
    assert swiped > 0
    fleet.tell({**told, "age_s": 0.0})
    page.clock.run_for(1500)
    expect(page.locator(".card").first).to_have_attribute(
        "data-robot", worst["robot_id"]
    )
    assert row.evaluate("(row) => row.scrollLeft") == swiped
    row.evaluate("(row) => { row.scrollLeft = 0; }")


def test_the_tab_of_the_log_leads_to_it_from_another_page(
    browser: Browser, past: Site
) -> None:
    with frozen_page(browser, past, (390, 844)) as page:
        page.goto(f"{past.url}/about")
        page.locator('.tabbar a[href="/#log-panel"]').click()
        settle(page, "#log li")
        page.clock.run_for(500)

        box = page.locator("#log-panel").bounding_box()
        header = page.locator(".header").bounding_box()
        assert box is not None
        assert header is not None
        assert abs(box["y"] - header["height"]) <= 2


@pytest.mark.parametrize("name", ["commands", "alerts", "decisions", "audit", "fleet"])
def test_no_column_of_a_list_is_cut(browser: Browser, past: Site, name: str) -> None:
    for language in ("es", "en"):
        with frozen_page(browser, past, (1024, 768), language=language) as page:
            page.goto(f"{past.url}/{name}")
            settle(page, ":is(.table--list, #machines) tbody tr")
            for wide, high in (*SIZES, (767, 900)):
                page.set_viewport_size({"width": wide, "height": high})
                assert evaluate(page, CUT_LISTS) == [], (language, wide)


@pytest.mark.parametrize("language", ["es", "en"])
@pytest.mark.parametrize("name", ["AGI", "Tractor"])
def test_a_phone_cuts_no_sentence_of_danger(
    browser: Browser, past: Site, language: str, name: str
) -> None:
    lost = staged.told(STAGED["lost while moving"][0])
    told = frozen()
    robot = told["snapshot"]["robots"][0]
    robot.update(robot_id=name, situation=lost, age_s=4.2, link="LOST")
    told["snapshot"]["robots"] = [robot]
    with frozen_page(
        browser, past, (844, 390), language=language, tell=lambda: told
    ) as page:
        page.goto(f"{past.url}/account")
        settle(page, "#status[data-level=danger]")
        page.clock.run_for(500)
        page.set_viewport_size({"width": 390, "height": 844})
        found = evaluate(page, SAID)
        assert page.locator("#status-said").inner_text().startswith(name)
        assert found["whole"]


def test_a_robot_of_the_fleet_page_is_a_few_lines_on_a_phone(
    browser: Browser, past: Site
) -> None:
    with frozen_page(browser, past, (390, 844)) as page:
        page.goto(f"{past.url}/fleet")
        settle(page, "#machines tbody tr")
        high = page.locator("#machines tbody tr").evaluate_all(
            "(rows) => rows.map((row) => row.offsetHeight)"
        )
    assert max(high) < 200


def test_a_tablet_cuts_no_number_of_alerts(browser: Browser, past: Site) -> None:
    with frozen_page(browser, past, (768, 1024)) as page:
        page.goto(past.url)
        settle(page, "#map-fit:enabled")
        wide = page.evaluate(NUMBER_OF_ALERTS)
    assert wide[0] <= wide[1]


NUMBER_OF_ALERTS = """() => {
  document.querySelector('.brand__house').textContent = 'Invernadero '.repeat(9);
  document.querySelector('#alerts-count').textContent = '125';
  const button = document.querySelector('#alerts-button');
  return [button.scrollWidth, button.clientWidth];
}"""
"""How wide the number of alerts is beside a long name, and its place (px)."""


@pytest.mark.parametrize("route", ["/", "/fleet"])
def test_a_page_that_has_heard_nothing_does_not_claim_that_nothing_is_there(
    browser: Browser, past: Site, route: str
) -> None:
    with frozen_page(browser, past, (1440, 900), language="en") as page:
        page.route_web_socket("**/live", lambda _: None)
        page.goto(past.url + route)
        settle(page, "body[data-loaded]")
        page.clock.run_for(1500)

        expect(page.locator("#alerts-count")).to_have_text("?")
        shown = page.locator(".empty:visible").all_inner_texts()
        assert [said for said in shown if NOTHING.search(said)] == []
        if route == "/":
            page.locator("[data-opens=people-panel]").click()
            said = page.locator("#people-none")
            expect(said).to_have_text("No link: unknown who is there")


NOTHING = re.compile("No robot|Nobody|Nothing has happened|No active alerts")


@pytest.mark.parametrize("size", [(390, 844), (667, 375), (768, 1024)])
def test_a_silent_server_is_told_whole_beside_whose_tablet_it_is(
    browser: Browser, past: Site, size: tuple[int, int]
) -> None:
    lines: list[WebSocketRoute] = []
    with frozen_page(browser, past, size, lines=lines) as page:
        page.goto(past.url)
        settle(page, "#map-fit:enabled")
        page.evaluate(TABLET)
        page.route_web_socket("**/live", lambda line: line.close())
        lines[-1].close()
        page.clock.run_for(4000)

        expect(page.locator("#health-sentence")).to_have_text("Servidor no responde")
        todo = page.locator(".card__todo").first
        expect(todo).to_have_text("trátelo como en marcha")
        assert evaluate(page, CUT_HEADER) == []


def test_a_phone_says_below_the_tap_that_its_browser_allows_no_notifications(
    browser: Browser, past: Site
) -> None:
    with frozen_page(browser, past, (390, 844)) as page:
        page.goto(past.url + "/settings")
        page.locator("#messages-section").evaluate("(section) => section.open = true")
        settle(page, "#push-join:visible")
        page.locator("#push-join").click()

        said = page.locator("#push-result")
        expect(said).to_have_text("El navegador no permite notificaciones de iVeg.")
        expect(said).to_be_in_viewport(ratio=1)
        # At one moment: what is above them may still be coming.
        apart = """said => said.getBoundingClientRect().top
          - document.querySelector('#push-join').getBoundingClientRect().bottom"""
        assert 0 <= said.evaluate(apart) < 24


CUT_LISTS = """() => [...document.querySelectorAll('.scroll-x')]
  .filter((it) => it.querySelector('.table--list, #machines'))
  .filter((it) => it.checkVisibility() && it.scrollWidth > it.clientWidth)
  .map((it) => `${it.id}: ${it.scrollWidth - it.clientWidth} px`)"""
"""Lists that are wider than their place."""


def test_the_screen_of_a_wall_looks_and_stops_and_frees_nothing(
    browser: Browser, past: Site
) -> None:
    told = snapshot(6)
    with frozen_page(
        browser, past, (1440, 900), language="en", tell=lambda: told
    ) as page:
        page.goto(past.url)
        settle(page, "#map-fit:enabled")
        page.locator(".user").click()
        page.get_by_role("button", name="Wall display").click()
        page.get_by_role("button", name="Begin").click()
        page.wait_for_selector("body[data-wall]:not([data-panel])")

        page.reload()
        settle(page, "body[data-wall] #map-fit:enabled")
        page.clock.run_for(4000)
        gone = page.locator(".nav, .rearm .button, .card__menu, .user")
        assert gone.count() > 0
        assert [one for one in gone.all() if one.is_visible()] == []
        expect(page.locator("body")).to_have_css("cursor", "none")
        assert evaluate(page, TAGS_ON_WORDS) == []
        expect(strip_stop(page, "fleet")).to_be_in_viewport(ratio=1)
        assert evaluate(page, COVERED_STOPS) == []
        answers = {
            path: _posted(page, path)
            for path in ("fleet/stop", "robots/AGI/release", "alerts/x/acknowledge")
        }
        assert answers == {
            "fleet/stop": 202,
            "robots/AGI/release": 403,
            "alerts/x/acknowledge": 403,
        }


TAGS_ON_WORDS = """() => [...document.querySelectorAll('.card')].filter((card) => {
  const bottom = (part) => card.querySelector(part).getBoundingClientRect().bottom;
  const mode = card.querySelector('.card__mode').getBoundingClientRect();
  return bottom('.link') > mode.top - 1;
}).map((card) => card.dataset.robot)"""
"""Cards on which the age covers what is said."""


def _posted(page: Page, path: str) -> object:
    """The status of a request that changes something, sent by the page itself."""
    return evaluate(page, _POST, f"/api/v1/{path}")


_POST = """async ([path]) => {
  const headers = {'X-IVEG': '1', 'Content-Type': 'application/json'};
  return (await fetch(path, {method: 'POST', headers, body: '{}'})).status;
}"""
