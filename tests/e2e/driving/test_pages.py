"""The pages beside the map: complete, reachable, readable, and never over a STOP."""

import re
from collections.abc import Mapping
from typing import Any
from urllib.parse import urljoin

import pytest
from playwright.sync_api import Page, Route, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.hands import in_header_or_menu
from tests.e2e.reading import (
    OVERFLOW,
    RUN_OVER,
    evaluate,
    serious,
    strip_stop,
    visit,
)
from tests.patience import AGAIN
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

ROUTES = (
    "/alerts",
    "/commands",
    "/decisions",
    "/fleet",
    "/climate",
    "/latency",
    "/settings",
)
OTHERS = ("/history", "/docs", "/about", "/audit")
"""Looked at in one theme."""
THEMES = ("dark", "sunlight")
STANDING = re.compile(r"PARADO")
_EVERY_TWELFTH = """document.querySelectorAll(".call")
  .forEach((one, number) => number % 12 && one.remove())"""


@pytest.fixture(scope="module")
def shown(stack: Site) -> Site:
    """A greenhouse in which something has happened: AGI was stopped once."""
    with stack.api() as api:
        command_id = api.post("robots/AGI/stop").json()["command_id"]

        def is_standing() -> bool:
            answer = api.get(f"commands/{command_id}")
            return bool(answer.json().get("state") == "STANDING")

        until(is_standing, "AGI stands")
    return stack


def test_every_page_is_accessible_in_every_theme(
    open_page: OpenPage, shown: Site
) -> None:
    page = open_page()

    found = {route: _violations(page, route) for route in ("/", *ROUTES)}

    assert found == {route: [] for route in found}


@pytest.mark.parametrize("route", OTHERS)
def test_nothing_serious_stands_in_the_way_of_assistive_technology(
    open_page: OpenPage, route: str
) -> None:
    page = open_page(route=route)
    # Labels name robots, so they come with the first snapshot.
    page.wait_for_selector('#mark:not([data-state="connecting"])')
    # One loop writes all sections of the interface: every twelfth stands for them.
    page.evaluate(_EVERY_TWELFTH)
    found: list[str] = []

    def has_settled() -> bool:
        found[:] = serious(page)
        return found == []

    try:
        until(has_settled, "a page without serious violations")
    finally:
        assert found == []


def test_the_commands_page_shows_a_stop_with_the_time_of_each_road(
    open_page: OpenPage, shown: Site
) -> None:
    page = open_page(route="/commands")

    row = page.locator("#orders-rows tbody tr").first
    expect(row).to_contain_text("AGI")
    expect(row).to_contain_text("program")
    # A program presses no button: nobody knows how long its order was on its way.
    times = row.locator("td.number")
    assert times.first.inner_text() == "—"

    def are_all_there() -> bool:
        # Sent and answered on both transports, standing, tries; FIWARE may answer last.
        _, *told = times.all_inner_texts()
        return bool(told) and all(text.strip().isdigit() for text in told)

    until(are_all_there, "the time of each transport")
    expect(page.locator("#took-standing")).to_contain_text("ms")


def test_a_new_stop_appears_on_the_commands_page_by_itself(
    open_page: OpenPage, shown: Site
) -> None:
    page = open_page(390, 844, route="/commands")
    rows = page.locator("#orders-rows tbody tr")
    expect(rows.first).to_be_visible()
    before = rows.count()

    strip_stop(page, "fleet").click()

    expect(rows.first).to_contain_text("operador")
    assert rows.count() > before
    assert evaluate(page, RUN_OVER) == []


def test_a_list_shows_one_robot_or_what_is_searched_for(
    open_page: OpenPage, shown: Site
) -> None:
    page = open_page(390, 844, route="/commands")
    rows = page.locator("#orders-rows tbody tr")
    expect(rows.filter(has_text="program").first).to_be_visible()

    page.locator('[data-only="AGI"]').click()
    expect(rows.filter(has_text=re.compile(r"AGII"))).to_have_count(0)
    expect(rows.first).to_contain_text("AGI")
    page.locator("#orders-search").fill("agi PROGRAM")
    expect(rows.filter(has_not_text="program")).to_have_count(0)
    expect(rows.first).to_be_visible()

    page.locator("#orders-search").fill("nadie")
    expect(page.locator("#orders-empty")).to_contain_text("estos filtros")
    assert evaluate(page, OVERFLOW) <= 0


def test_every_decision_is_listed_and_leads_to_its_own_page(
    open_page: OpenPage, shown: Site
) -> None:
    page = open_page(390, 844, route="/decisions")
    row = page.locator("#decisions-rows tbody tr").first
    expect(row).to_contain_text("→ 50")
    assert evaluate(page, OVERFLOW) <= 0

    row.locator("a").click()

    expect(page.locator("#decision-record")).to_contain_text("→ 50")
    page.wait_for_url(re.compile(r"/decisions/.+"))
    speed = page.locator(".plot__area [data-kind=speed]")
    expect(speed).to_have_attribute("d", re.compile(r"^M[\d.]+ [\d.]+h0"))


def test_paper_gets_the_table_and_no_stop(open_page: OpenPage, shown: Site) -> None:
    page = open_page(route="/commands")
    expect(page.locator("#orders-rows tbody tr").first).to_be_visible()

    page.emulate_media(media="print")

    expect(page.locator("#orders-rows tbody tr").first).to_be_visible()
    assert page.locator("[data-stop]:visible").count() == 0
    # Heads of columns sort on the screen; on paper they are words.
    assert page.locator("button:visible:not(th button)").count() == 0


PAPER = """() => {
  document.body.style.width = '640px';
  dispatchEvent(new Event('beforeprint'));
  return [...document.querySelectorAll('.chart__place .main-svg')].map((svg) => {
    const place = svg.closest('.chart__place').getBoundingClientRect();
    const drawn = svg.getBoundingClientRect();
    return [drawn.right - place.right, svg.classList.contains('main-svg--dark')];
  });
}"""
"""How far each figure sticks out of its place on paper (px), and whether it is dark."""


def test_charts_are_whole_on_paper_and_stop_is_alive_after_print_and_export(
    open_page: OpenPage, shown: Site
) -> None:
    with shown.api() as api:

        def is_kept() -> bool:
            charts = api.get("history/charts").json()
            return all(charts[one]["data"] for one in ("speed", "stops"))

        until(is_kept, "speeds and a STOP in the history")
    page = open_page(route="/history")
    page.locator("#chart-speed .main-svg").first.wait_for(state="attached")
    page.locator("#chart-stops .main-svg").first.wait_for(state="attached")
    page.evaluate("document.documentElement.dataset.theme = 'dark'")

    page.emulate_media(media="print")
    figures = evaluate(page, PAPER)

    assert len(figures) >= 4
    assert [one for one in figures if one[0] > 1 or not one[1]] == []
    assert page.locator("[data-stop]:visible, .button:visible").count() == 0

    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.locator(".main-svg[viewBox], .main-svg--dark").count() == 0
    with page.expect_download() as download:
        page.click('[data-export="commands"][data-format="csv"]')
    assert "AGI" in download.value.path().read_text()
    expect(page.locator("#mark")).to_have_attribute("data-state", "open")
    expect(strip_stop(page, "AGI")).to_have_attribute("data-state", "standing")


def test_the_fleet_page_draws_the_whole_chain_and_each_device(
    open_page: OpenPage,
) -> None:
    page = open_page(route="/fleet")

    for hop in ("robots", "mqtt", "iot_agent", "orion", "notifications", "screen"):
        box = page.locator(f'.hop-box[data-hop="{hop}"]')
        expect(box).to_have_attribute("data-state", "ok")
    expect(page.locator("#data-path-sentence")).to_have_text(
        re.compile("Cada dato llega")
    )
    expect(page.locator("#machines tbody tr")).to_have_count(2)
    lidar = page.locator("#devices tr", has_text="AGI_lidar2D")
    expect(lidar).to_contain_text("hace 0,")


def test_the_climate_page_shows_what_the_greenhouse_measures_and_remembers_it(
    open_page: OpenPage,
) -> None:
    page = open_page(route="/climate")

    expect(page.locator("#climate-temperature")).to_have_text(
        re.compile(r"^\d+,\d °C$")
    )
    expect(page.locator("#climate-sentence")).to_contain_text("al día")
    expect(page.locator("#trend-temperature .main-svg").first).to_be_visible()
    expect(page.locator("#trend-note")).to_contain_text("una por minuto")
    # Its age begins anew with each reading, every ten seconds.
    age = page.locator("#climate-co2-age")
    expect(age).to_have_text(re.compile(r"^hace [4-9] s$"))
    expect(age).to_have_text(re.compile(r"^hace [0-2] s$"))

    page.click('[data-language="en"]')
    expect(page.locator("#climate-temperature")).to_have_text(
        re.compile(r"^\d+\.\d °C$")
    )


def test_a_day_of_the_climate_is_drawn_in_the_readers_words(
    open_page: OpenPage,
) -> None:
    page = open_page(390, 844, route="/about")
    page.route("**/api/v1/history/climate", _day)

    visit(page, "/climate")

    expect(page.locator("#trend-temperature .main-svg").first).to_be_visible()
    expect(page.locator("#trend-temperature")).to_contain_text("21,5")
    # Noon in Madrid, in November.
    expect(page.locator("#trend-temperature")).to_contain_text("12:00")
    expect(page.locator("#trend-temperature-says")).to_contain_text("máximo 22,0 °C")
    expect(page.locator("#trend-co2-says")).to_contain_text("ninguna lectura")
    assert evaluate(page, OVERFLOW) <= 0
    assert _seriously_wrong_in_any_theme(page) == []

    in_header_or_menu(page, '[data-language="en"]').click()
    expect(page.locator("#trend-temperature")).to_contain_text("21.5")
    page.unroute_all(behavior="wait")


def test_a_day_without_climate_says_so(open_page: OpenPage) -> None:
    page = open_page(route="/about")
    page.route("**/api/v1/history/climate", lambda route: _fulfil(route, {}))

    visit(page, "/climate")

    expect(page.locator("#trend-empty")).to_have_text(
        "Aún no hay datos de las últimas 24 h."
    )
    expect(page.locator("#trends")).to_be_hidden()
    page.unroute_all(behavior="wait")


def test_the_latency_page_shows_the_papers_table_live_beside_what_it_printed(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(route="/latency")

    glance = page.locator("#hops-glance .multiple")
    expect(glance.first).to_have_text(re.compile(r"odometría\d+,\d ms · P95 \d+,\d ms"))
    expect(glance).to_have_count(4)
    row = page.locator("#hops-table tbody tr").first
    expect(row).to_contain_text("odometría")
    # Mean and P95 in ms with n, in Spanish numbers.
    measured = re.compile(r"^\d+,\d · \d+,\d \(n \d+\)$")
    expect(row.locator("td.number").nth(0)).to_have_text(measured)
    expect(row.locator("td.number").nth(3)).to_have_text(measured)
    printed = page.locator("#hops-table tbody tr").nth(2)
    expect(printed).to_contain_text("16,9 · 103,9")
    expect(page.locator("#hops-cdf .main-svg").first).to_be_visible()
    way = re.compile(r"^AGII?, [^,]+, \d\d:\d\d:\d\d: \d+,\d ms del reloj")
    expect(page.locator("#hops-trace-says")).to_have_text(way)
    expect(page.locator("#hops-clocks")).to_contain_text("AGI: reloj en hora")

    page.click('[data-of="AGI"]')
    page.click('[data-window="1min"]')
    expect(row.locator("td.number").nth(0)).to_have_text(measured)
    expect(page.locator("#hops-csv")).to_have_attribute(
        "href", "/api/v1/latency?format=csv&window=1min&robot=AGI"
    )
    page.click('[data-language="en"]')
    expect(printed).to_contain_text("16.9 · 103.9")
    expect(glance.first).to_contain_text("Δt₁ robot → broker")
    assert evaluate(page, OVERFLOW) <= 0


def test_the_latency_page_folds_its_tables_behind_the_figures(
    open_page: OpenPage,
) -> None:
    page = open_page(390, 844, route="/latency")
    expect(page.locator("#hops-cdf .main-svg").first).to_be_visible()
    table = page.locator("#hops-table tbody")
    expect(table).to_be_hidden()
    assert page.evaluate("document.documentElement.scrollHeight") < 3500

    page.locator(".fold summary").first.click()

    expect(table).to_be_visible()
    assert evaluate(page, OVERFLOW) <= 0


def test_the_settings_page_shows_the_rule_in_force(
    open_page: OpenPage, stack: Site
) -> None:
    with stack.api() as api:
        rule = api.get("rule").json()
    share, radius = (
        f"{100 * rule['confidence_threshold']:.0f}",
        f"{rule['radius_m']:.1f} m",
    )

    page = open_page(route="/settings")

    expect(page.locator("#rule-threshold")).to_have_text(re.compile(rf"{share}\W%"))
    expect(page.locator("#rule-radius")).to_have_text(radius.replace(".", ","))
    expect(page.locator("#rule-version")).to_have_text(str(rule["version"]))
    expect(page.locator("details.section:not([open])")).to_have_count(0)


def test_28_7_settings_on_a_phone_are_folded_and_an_address_opens_one(
    open_page: OpenPage,
) -> None:
    page = open_page(390, 844, route="/settings")
    opened = page.locator("details.section[open]")

    expect(opened).to_have_attribute("id", "rule-section")
    expect(page.locator("#rule-form")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollHeight") < 1500
    page.locator("#sound-section summary").press("Enter")
    expect(page.locator("#sound-section")).to_have_attribute("open", "")

    page.goto(f"{page.url}#code-title")

    expect(page.locator("#code-show")).to_be_in_viewport()
    assert serious(page) == []


def test_every_entry_of_the_menu_leads_to_its_page(open_page: OpenPage) -> None:
    page = open_page(390, 844, route="/about")
    links = page.locator("#menu nav a")
    places = [str(link.get_attribute("href")) for link in links.all()]
    assert {"/alerts", "/commands", "/fleet", "/climate", "/settings"} < set(places)
    assert [place for place in places if not _heading(page, place)] == []

    page.wait_for_selector('#mark[data-state="open"]', state="attached")
    page.locator(".tabbar [data-opens=menu]").click()
    page.locator('#menu nav a[href="/fleet"]').click()
    page.wait_for_url("**/fleet")


def test_a_page_says_when_its_list_cannot_be_read(open_page: OpenPage) -> None:
    page = open_page(route="/about", alone=True)
    page.route("**/api/v1/alerts*", lambda route: route.abort())

    page.goto(page.url.replace("/about", "/alerts"))

    expect(page.locator("#past-error")).to_contain_text("Sin conexión")
    expect(page.locator("#past-empty")).to_be_hidden()


def _heading(page: Page, place: str) -> str | None:
    """What the page of a place is called; None without one."""
    answer = page.request.get(urljoin(page.url, place), max_retries=AGAIN)
    found = re.search(r"<h1[^>]*>\s*(\S[^<]*)", answer.text())
    return found[1] if found and answer.ok else None


def _day(route: Route) -> None:
    """Two readings an hour apart on a day in November."""
    noon = 1_795_172_400_000
    x, y = [noon, noon + 3_600_000], [21.0, 22.0]
    trace = {"type": "scatter", "mode": "lines", "name": "", "x": x, "y": y}
    _fulfil(route, {"temperature": trace})


def _fulfil(route: Route, traces: Mapping[str, Mapping[str, Any]]) -> None:
    """What the API answers, but of these traces."""
    answer = route.fetch()
    air: dict[str, Any] = {
        **answer.json(),
        "since": "2026-11-20T10:00:00.000Z",
        "until": "2026-11-20T13:00:00.000Z",
    }
    for part, figure in air["figures"].items():
        figure["data"] = [
            {**trace, "meta": {"kind": part}}
            for name, trace in traces.items()
            if name == part
        ]
        figure["layout"]["yaxis"].pop("range", None)
    route.fulfill(response=answer, json=air)


def _violations(page: Page, route: str) -> list[str]:
    visit(page, route)
    page.wait_for_function(_LABELLED)
    return _seriously_wrong_in_any_theme(page)


def _seriously_wrong_in_any_theme(page: Page) -> list[str]:
    """All rules in the first theme; in the others those on colour, which differ."""
    found = serious(page)
    for theme in THEMES:
        evaluate(page, _WEAR, theme)
        found += serious(page, "color-contrast")
    return found


_WEAR = "([theme]) => { document.documentElement.dataset.theme = theme; }"
_LABELLED = """() => document.querySelector('[aria-busy=true]') === null
  && !document.querySelector('#time-strip:not([aria-label])')
  && !document.querySelector('.card__menu:not([aria-label])')"""
"""What is named in the reader's words has its name."""
