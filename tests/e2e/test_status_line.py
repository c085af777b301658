"""The status line cuts no sentence, in any window, language or size of letters.

It stands beside other words that come and go, on screens that are low or narrow or both
(a page at 200 % has half of its pixels), before readers who have set larger letters.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, WebSocketRoute

from tests import staged
from tests.e2e.frozen import Frozen, frozen, frozen_page, past_site, settle
from tests.e2e.reading import TABLET, evaluate
from tests.processes import Site
from tests.staged import STAGED

pytestmark = pytest.mark.e2e

LOW = ((568, 320), (667, 375), (768, 390), (844, 390), (932, 430), (1180, 500))
NARROW = ((320, 568), (390, 844), (768, 1024))
WIDE = ((1000, 700), (1024, 768), (1200, 800), (1400, 900))
ZOOMED = ((720, 450), (512, 384), (422, 195), (195, 422))
"""Windows of 1440, 1024, 844 and 390 px at 200 %."""
WINDOWS = (*LOW, *NARROW, *WIDE)
LARGE_LETTERS_PX = 28
"""The smallest that some readers set; most set nothing."""


@dataclass
class Told:
    """A page, and what it is told of its only robot."""

    page: Page
    line: WebSocketRoute
    robot: dict[str, Any]

    def tell(self, staged_name: str) -> None:
        known = STAGED[staged_name][0]
        said = {"situation": staged.told(known), "age_s": known.age_s}
        topic = f"robots/{self.robot['robot_id']}"
        data = {**self.robot, **said}
        self.line.send(json.dumps({"topic": topic, "data": data}))
        self.page.evaluate("() => fetch('/healthz')")
        self.page.clock.run_for(500)


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server that has no robots."""
    with past_site(tmp_path_factory.mktemp("status")) as place:
        yield place


@pytest.fixture(scope="module", params=["es", "en"])
def told(
    request: pytest.FixtureRequest, browser: Browser, past: Site
) -> Iterator[Told]:
    """A page of one robot that has a long name."""
    snapshot = _of_one()
    lines: list[WebSocketRoute] = []
    look = ("light", request.param)
    with frozen_page(
        browser, past, (1440, 900), *look, tell=lambda: snapshot, lines=lines
    ) as page:
        page.goto(f"{past.url}/account")
        settle(page, "#status:not([data-level=away])")
        yield Told(page, lines[-1], snapshot["snapshot"]["robots"][0])


def _of_one() -> Frozen:
    told = frozen()
    robot = {**told["snapshot"]["robots"][0], "robot_id": "Cosechadora-de-la-nave-3"}
    told["snapshot"]["robots"] = [robot]
    return told


@pytest.mark.parametrize("beside", [None, TABLET], ids=["own", "shared tablet"])
def test_no_sentence_is_cut_or_covered(told: Told, beside: str | None) -> None:
    if beside is not None:
        told.page.evaluate(beside)
    cut = {}
    for name in ("lost while moving", "does not slow"):
        told.tell(name)
        for wide, high in (*WINDOWS, *ZOOMED):
            told.page.set_viewport_size({"width": wide, "height": high})
            cut[name, wide, high] = evaluate(told.page, CUT, 0)
            if (wide, high) in WINDOWS:
                cut[name, wide, high] += evaluate(told.page, CUT, LARGE_LETTERS_PX)
                told.page.evaluate("() => { document.adoptedStyleSheets = [] }")
    assert {where: found for where, found in cut.items() if found} == {}


def test_a_line_that_grew_is_as_high_as_before_in_another_window(told: Told) -> None:
    high = []
    for size in ((1440, 900), (195, 422), (1440, 900)):
        told.page.set_viewport_size({"width": size[0], "height": size[1]})
        evaluate(told.page, CUT, 0)
        high.append(told.page.locator("#status").evaluate("(it) => it.offsetHeight"))

    assert high[0] == high[2] < high[1]


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
