"""Where things stand on every page and in every window, and that no STOP is covered.

Pages show a snapshot (``tests.e2e.frozen``): nothing moves while it is measured, and
each fleet has one page for all sizes.
"""

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, WebSocketRoute, expect

from iveg.models.snapshot import Snapshot
from tests import staged
from tests.e2e.frozen import (
    HOLD,
    STANDS,
    Frozen,
    frozen,
    frozen_page,
    order,
    past_site,
    settle,
    snapshot,
)
from tests.e2e.hands import press_open
from tests.e2e.reading import (
    COVERED_STOPS,
    OVERFLOW,
    SMALLEST_STOP,
    card,
    evaluate,
    strip_stop,
    visit,
)
from tests.pictures.pages import PAST, prepare
from tests.pictures.scenes import IDS
from tests.pictures.scenes import fleet as fleet_in
from tests.processes import Site
from tests.staged import STAGED

pytestmark = pytest.mark.e2e

APART_PX, LARGE_PX = 24, 64
DESKTOPS = ((1200, 800), (1440, 900), (1500, 900), (1920, 1080))
OTHERS = ((1024, 768), (844, 390), (667, 375), (768, 1024), (390, 844), (360, 740))
SIZES = (*DESKTOPS, *OTHERS)
FEW = ((1440, 900), (1024, 768), (667, 375), (390, 844), (360, 740))
"""For what is looked at in every situation."""
ROUTES = (
    *("/alerts", "/commands", "/history", "/fleet", "/climate", "/settings"),
    *("/about", "/decisions/none", "/no-such-page", "/"),
)


@dataclass
class Told:
    """A page, and the lines by which it hears of its robots."""

    page: Page
    lines: list[WebSocketRoute] = field(default_factory=list)
    robots: list[dict[str, Any]] = field(default_factory=list)

    def at(self, size: tuple[int, int]) -> Page:
        """The page in a window of this size."""
        self.page.set_viewport_size({"width": size[0], "height": size[1]})
        self.page.clock.run_for(250)
        return self.page

    def tell(self, *robots: dict[str, Any]) -> None:
        """Robots' states change."""
        for robot in robots:
            topic = f"robots/{robot['robot_id']}"
            self.lines[-1].send(json.dumps({"topic": topic, "data": robot}))
        self.page.evaluate("() => fetch('/healthz')")
        self.page.clock.run_for(500)

    def stage(self, name: str) -> None:
        """The first robot is in one of ``STAGED``."""
        known = STAGED[name][0]
        said = {"situation": staged.told(known), "age_s": known.age_s}
        self.tell({**self.robots[0], **said})


Show = Callable[..., Told]


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server of two robots that have never spoken."""
    with past_site(tmp_path_factory.mktemp("layout")) as place:
        yield place


@pytest.fixture(scope="module")
def past_of_ten(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """One of ten."""
    names = ",".join(IDS)
    with past_site(tmp_path_factory.mktemp("ten"), IVEG_ROBOTS=names) as place:
        yield place


@pytest.fixture
def show(browser: Browser, past: Site) -> Iterator[Show]:
    """Opens the live page, or another, of a snapshot."""

    def open_one(
        told: Frozen,
        place: Site = past,
        route: str = "/",
        ready: str = "#map-fit:enabled",
        **look: str,
    ) -> Told:
        lines: list[WebSocketRoute] = []
        size = (1440, 900)
        context = frozen_page(
            browser, place, size, tell=lambda: told, lines=lines, **look
        )
        page = pages.enter_context(context)
        page.goto(place.url + route)
        settle(page, ready)
        return Told(page, lines, told["snapshot"]["robots"])

    with ExitStack() as pages:
        yield open_one


def test_the_snapshot_is_one_that_a_server_may_send() -> None:
    told = frozen()["snapshot"]

    assert Snapshot.model_validate(told).model_dump(mode="json") == told


# --- every page, every window ---------------------------------------------------------


@pytest.mark.parametrize("count", [2, 6])
def test_nothing_overflows_or_covers_a_stop_and_stops_stand_apart(
    show: Show, count: int
) -> None:
    told = show(snapshot(count))

    for size in SIZES:
        page = told.at(size)
        assert evaluate(page, OVERFLOW) == 0, size
        assert evaluate(page, COVERED_STOPS) == [], size
        assert evaluate(page, NEAREST_STOP) >= APART_PX, size
        assert evaluate(page, SMALLEST_STOP) >= LARGE_PX, size


def test_no_page_no_dialog_and_no_message_covers_a_stop_in_any_window(
    show: Show, past: Site
) -> None:
    """The gravest message: a STOP that is not obeyed."""
    told = show(fleet_in(2, "disobeyed"))
    found = {}

    for route in ROUTES:
        visit(told.page, route)
        told.page.clock.run_for(500)
        expect(told.page.locator("#p1 .p1__line")).to_be_visible()
        for size in ((1440, 900), (768, 1024), (390, 844), (360, 740)):
            page = told.at(size)
            found[route, size] = [
                *evaluate(page, COVERED_STOPS),
                *([] if evaluate(page, OVERFLOW) <= 0 else ["too wide"]),
                *([] if evaluate(page, SMALLEST_STOP) >= LARGE_PX else ["too small"]),
            ]
            if route in ("/", "/fleet"):
                found[route, size] += _covered_by_dialogs(page)

    assert {where: one for where, one in found.items() if one} == {}


def _covered_by_dialogs(page: Page) -> list[Any]:
    """STOPs that something covers while a dialog is open, of each in turn."""
    covered = []
    for opener in page.locator("[data-opens]:visible, .card__menu:visible").all():
        press_open(page, opener)
        page.clock.run_for(250)
        covered += evaluate(page, COVERED_STOPS)
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog[open]", state="hidden")
    return covered


def test_without_the_server_no_stop_is_covered(show: Show) -> None:
    told = show(snapshot(2))
    told.page.route_web_socket("**/live", lambda line: line.close())
    told.lines[-1].close()
    told.page.clock.run_for(4000)

    expect(told.page.locator("#status")).to_contain_text("Sin conexión")
    for size in FEW:
        page = told.at(size)
        assert (evaluate(page, COVERED_STOPS), evaluate(page, OVERFLOW)) == ([], 0)


def test_the_bar_of_the_past_covers_no_stop(
    browser: Browser, past_of_ten: Site
) -> None:
    """A robot disobeys then, as now; nobody is told what to do about then."""
    told = fleet_in(10, "disobeyed")
    with frozen_page(browser, past_of_ten, SIZES[0], tell=lambda: told) as page:
        prepare(page, told)
        page.goto(past_of_ten.url + PAST)
        settle(page, "#map-fit:enabled")
        for size in (*FEW, (768, 1024)):
            Told(page).at(size)
            assert evaluate(page, COVERED_STOPS) == []
            assert evaluate(page, OVERFLOW) == 0
            expect(page.locator("#p1 .p1__line")).to_be_in_viewport(ratio=1)

        then = page.locator(".card[data-level=danger]")
        expect(then.locator(".card__todo")).to_be_empty()
        expect(page.locator("#status-said")).to_contain_text("use la seta roja")


# --- the status line and cards --------------------------------------------------------


@pytest.mark.parametrize("language", ["es", "en"])
def test_the_status_line_cuts_no_sentence_in_any_window_or_size_of_letters(
    show: Show, language: str
) -> None:
    snapshot_of_one = frozen()
    robot = snapshot_of_one["snapshot"]["robots"][0]
    robots = [{**robot, "robot_id": "Cosechadora-de-la-nave-3"}]
    snapshot_of_one["snapshot"]["robots"] = robots
    away = "#status:not([data-level=away])"
    told = show(snapshot_of_one, route="/account", ready=away, language=language)
    cut = {}

    for name in ("lost while moving", "does not slow"):
        told.stage(name)
        for wide, high in (*WINDOWS, *ZOOMED):
            told.page.set_viewport_size({"width": wide, "height": high})
            letters = (0, LARGE_LETTERS_PX) if (wide, high) in WINDOWS else (0,)
            for px in letters:
                cut[name, wide, high, px] = evaluate(told.page, CUT, px)
            told.page.evaluate("() => { document.adoptedStyleSheets = [] }")

    assert {where: found for where, found in cut.items() if found} == {}


# --- a finger on its way --------------------------------------------------------------


def states(robot: str) -> list[dict[str, Any]]:
    """What a robot may say, with and without a STOP and a warning."""
    commands = (
        *("REQUESTED", "SENT", "DELIVERED", "STANDING", "UNCONFIRMED", "STILL_MOVING"),
        *("STALE", "RELEASING", "READY"),
    )
    moved = order(robot, "SENT", reason="moved")
    warned = {"reason": "clear", "cause": None, "age_s": 0.3, "feedback_age_s": 0.4}
    fault = {"code": "no_scan", "about": "AGI", "for_s": 12.0}
    return [
        {},
        {"applied": None, "margin": None, "navigation": None, "battery": None},
        {"age_s": 2.0},
        {"age_s": 9.0, "pose": None, "twist": None},
        {"mode": "STOPPED", "holds": [{**HOLD, "source": "hw", "ack": "local"}]},
        *(
            {
                **STANDS,
                "holds": [] if state == "READY" else [HOLD],
                "stop": order(robot, state),
            }
            for state in commands
        ),
        {"holds": [HOLD], "stop": moved, "applied": {**warned, "faults": [fault]}},
    ]


@pytest.mark.parametrize(("count", "language"), [(2, "en"), (4, "es")])
def test_nothing_moves_stop_release_or_resume(
    show: Show, count: int, language: str
) -> None:
    """Of more than two robots, Release and Resume stand in a menu, which is open."""
    told = show(snapshot(count), language=language)
    told.page.clock.run_for(1500)  # The cards find their order.
    if count > 2:
        card(told.page, "AGI").locator(".card__menu").click()
    sizes = (1440, 900), (768, 1024), (390, 844)

    def places() -> list[list[str]]:
        return [evaluate(told.at(size), PLACES) for size in sizes]

    before = places()
    for n in range(len(states(""))):
        told.tell(
            *(
                {**one, "age_s": 0.0, **states(one["robot_id"])[n]}
                for one in told.robots
            )
        )
        assert places() == before, n
        assert evaluate(told.page, SPILLED) == [], n
        both = evaluate(told.page, BOTH)
        assert both != []
        assert [one for one, other in both if one != other] == [], n


@pytest.mark.parametrize("count", [4, 10])
def test_on_a_phone_a_stop_is_one_tap_away_and_one_of_ten_two(
    show: Show, count: int
) -> None:
    told = show(snapshot(count))
    page = told.at((390, 844))

    for route in ("/alerts", "/settings", "/"):
        visit(page, route)
        page.clock.run_for(500)
        whole = strip_stop(page, "fleet")
        expect(whole).to_be_in_viewport(ratio=1)
        if count > 4:
            before = whole.bounding_box()
            page.locator("#stops-more").click()
            assert whole.bounding_box() == before
        for robot in told.robots:
            expect(strip_stop(page, robot["robot_id"])).to_be_in_viewport(ratio=1)
        assert evaluate(page, COVERED_STOPS) == []


def test_no_drawer_covers_a_stop_of_a_tablet(show: Show) -> None:
    page = show(snapshot(10)).at((768, 1024))

    page.locator(".drawer-open").click()
    page.clock.run_for(500)

    expect(page.locator("#log-panel[data-open]")).to_be_in_viewport()
    assert evaluate(page, COVERED_STOPS) == []
    assert page.locator("#stops .stop:visible, #stops-more:visible").count() >= 2


def test_of_a_flood_of_alerts_the_gravest_is_open_and_a_tap_opens_others(
    show: Show, past_of_ten: Site
) -> None:
    rows = "#past-rows tbody tr"
    told = show(fleet_in(10, "flooded"), past_of_ten, route="/alerts", ready=rows)
    page = told.at((390, 844))
    first = page.locator("#active-alerts > li").first

    expect(first).to_have_attribute("data-priority", "P1")
    expect(first.locator("form:visible button").first).to_be_visible()
    expect(page.locator("#active-alerts > li > details[open]")).to_have_count(1)
    row = page.locator("#active-alerts > li").nth(3)
    expect(row.locator("form").first).to_be_hidden()
    row.locator("summary").first.click()
    expect(row.locator("form").first).to_be_visible()
    assert evaluate(page, COVERED_STOPS) == []


# --- what a page is asked -------------------------------------------------------------

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

LOW = ((568, 320), (667, 375), (768, 390), (844, 390), (932, 430), (1180, 500))
NARROW = ((320, 568), (390, 844), (768, 1024))
WIDE = ((1000, 700), (1024, 768), (1200, 800), (1400, 900))
ZOOMED = ((720, 450), (512, 384), (422, 195), (195, 422))
"""Windows of 1440, 1024, 844 and 390 px at 200 %."""
WINDOWS = (*LOW, *NARROW, *WIDE)
LARGE_LETTERS_PX = 28
"""The smallest that some readers set; most set nothing."""

CUT = """async ([px]) => {
  const said = document.querySelector('#status-said');
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(px ? `#status-said { font-size: ${px}px !important }` : '');
  document.adoptedStyleSheets = [sheet];
  const drawn = () => new Promise((done) => {
    const seen = new IntersectionObserver(() => done(seen.disconnect()));
    seen.observe(said);
  });
  await drawn();
  await drawn();
  const line = document.querySelector('#status').getBoundingClientRect();
  const range = document.createRange();
  range.selectNodeContents(said);
  return [...range.getClientRects()].flatMap((box) => {
    const isOut = box.top < line.top - 3 || box.bottom > line.bottom + 3
      || box.left < line.left || box.right > line.right + 1
      || box.right > innerWidth + 1;
    const hits = [box.left + 2, (box.left + box.right) / 2, box.right - 2]
      .map((x) => document.elementFromPoint(x, (box.top + box.bottom) / 2));
    const over = hits.find((hit) => hit && !hit.closest('#status'));
    if (!isOut && !over) return [];
    return [`${Math.round(box.top)}-${Math.round(box.bottom)} of ${line.height} px`
      + `: ${over?.className ?? ''} ${said.textContent}`];
  });
}"""
"""Lines of the sentence that end outside of its place, or lie under something, with
letters of so many px at least, once the page has been drawn with them."""

PLACES = """() => [...document.querySelectorAll(
  '[data-stop], [data-release], [data-resume]')]
  .filter((one) => one.checkVisibility())
  .map((one) => {
    const {x, y, width, height} = one.getBoundingClientRect();
    const where = [scrollX + x, scrollY + y, width, height].map(Math.round);
    return `${one.dataset.stop ?? one.ariaLabel} ${where}`;
  })"""

SPILLED = """() => [...document.querySelectorAll('[data-stop]')]
  .filter((one) => one.checkVisibility())
  .filter((one) => {
    const {left, top, right, bottom} = one.getBoundingClientRect();
    const cut = parseFloat(getComputedStyle(one).getPropertyValue('--cut'));
    const words = document.createRange();
    words.selectNodeContents(one.querySelector('.stop__label'));
    return [...words.getClientRects()].some((line) => {
      // Letters end before their line does, and few stand in its corners.
      const [high, low] = [line.top + 2 - top, bottom + 2 - line.bottom];
      const side = Math.min(line.left - left, right - line.right);
      const end = Math.min(high, low);
      return side < 0 || end < 0 || side + end < cut - 2;
    });
  })
  .map((one) => `${one.dataset.state} ${one.innerText} ${innerWidth}`)"""
"""STOPs whose words do not fit, or run over a corner of the octagon (px)."""

BOTH = """() => [...document.querySelectorAll('.card .stop')].map((one) => {
  const twin = document.querySelector(`#stops [data-stop="${one.dataset.stop}"]`);
  return [one, twin].map((it) =>
    `${it.dataset.state} ${it.querySelector('.stop__label').textContent}`);
})"""
