"""What a person reads off the page."""

import re
from typing import Any

from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import Locator, Page

STANDING = re.compile(r"PARADO \(hace [\d,]+ s\)")
"""What a control says of a robot that stands after a STOP."""
HALVED = re.compile(r"50\W?%: .*(?:persona|robot)")
"""What the log says of a robot that was slowed, and why."""


def card(page: Page, robot: str) -> Locator:
    """The card of a robot."""
    return page.locator(f'.card[data-robot="{robot}"]')


def number(page: Page, robot: str, field: str) -> float:
    """A read-out of a robot's card, in either language's notation."""
    text = card(page, robot).locator(f'[data-field="{field}"]').inner_text()
    kept = "".join(c for c in text.replace("−", "-") if c.isdigit() or c in "-,.")
    return float(kept.replace(",", "."))


def strip_stop(page: Page, who: str) -> Locator:
    """The STOP control of the strip that every route has: a robot's id or ``fleet``."""
    return page.locator(f'#stops [data-stop="{who}"]')


def wait_for_mode(page: Page, robot: str, *modes: str) -> None:
    """Until a card shows one of these modes."""
    wanted = ", ".join(f'[data-robot="{robot}"][data-mode="{mode}"]' for mode in modes)
    page.wait_for_selector(wanted)


def evaluate(page: Page, script: str, *arguments: object) -> Any:
    """The result of a function in the page."""
    return page.evaluate(script, list(arguments))


def wait_for_paintings(page: Page, *robots: str) -> None:
    """Until more than thirty poses and thirty scans of each robot were painted."""
    evaluate(page, _NOTE_PAINTED)
    for robot in robots:
        for kind in ("odom", "lidar"):
            page.wait_for_function(
                "key => window.painted[key]?.size > 30", arg=f"{robot} {kind}"
            )


_NOTE_PAINTED = """() => {
  window.painted = {};
  window.__onPaint = ({robot, kind, stamp}) => {
    const key = `${robot} ${kind}`;
    (window.painted[key] ??= new Set()).add(stamp);
  };
}"""


def serious(page: Page, *rules: str) -> list[str]:
    """What stands in the way of assistive technology, one sentence each.

    Args:
        page: As it is now.
        rules: Of axe; none asks for all of them.
    """
    options: dict[str, Any] = {"resultTypes": ["violations"]}
    if rules:
        options["runOnly"] = {"type": "rule", "values": list(rules)}
    if not page.evaluate("() => 'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    found: list[str] = page.evaluate(_AXE, options)
    return found


_AXE = """async (options) => (await axe.run(options)).violations
  .filter(({impact}) => ['serious', 'critical'].includes(impact))
  .map(({id, nodes}) => `${id}: ${nodes[0].html}`)"""


def visit(page: Page, route: str) -> None:
    """Another page of the same greenhouse, until it hears the server."""
    page.goto(re.sub(r"(://[^/]+).*", rf"\1{route}", page.url))
    page.wait_for_selector('#mark[data-state="open"]', state="attached")


COVERED_STOPS = """() => [...document.querySelectorAll('[data-stop]')]
  .filter((stop) => stop.checkVisibility({visibilityProperty: true}))
  .map((stop) => {
    if (!stop.closest('#stops'))
      stop.scrollIntoView({block: 'center', inline: 'center'});
    const box = stop.getBoundingClientRect();
    const x = box.x + box.width / 2, y = box.y + box.height / 2;
    const hit = document.elementFromPoint(x, y);
    if (stop.contains(hit)) return null;
    const over = hit ? `${hit.tagName} ${hit.id} ${hit.className}` : 'nothing';
    return `${stop.dataset.stop} of ${stop.className} at ${x}, ${y}: ${over}`;
  }).filter((said) => said !== null)"""
"""Which visible STOPs a finger at their centre would miss, and what it would hit.
Those of cards may have to be scrolled to; those of the strip are always in sight."""


OVERFLOW = "() => document.documentElement.scrollWidth - innerWidth"
"""By how much the page is wider than the screen (px)."""

SMALLEST_STOP = """() => Math.min(...[...document.querySelectorAll(
  '#stops [data-stop]')].filter((stop) => stop.checkVisibility()).flatMap((stop) => {
    const {width, height} = stop.getBoundingClientRect();
    return [width, height];
  }), document.querySelector('#stops [data-stop]') ? Infinity : 0)"""
"""The shorter side of the smallest STOP of the strip (px); 0 without any."""


ON_SCREEN = """async ([zones, robots]) => {
  const {createViewport, fitTo, screenX, screenY} =
    await import('/static/js/map/viewport.js');
  const {coverOf} = await import('/static/js/map/layers/scalebar.js');
  const {bounds} = await (await fetch('/api/v1/map')).json();
  const {left, top, width, height} =
    document.querySelector('#map').getBoundingClientRect();
  const over = [...document.querySelectorAll('[data-over-map]')].map((element) => {
    const box = element.getBoundingClientRect();
    return {left: box.left - left, top: box.top - top,
            right: box.right - left, bottom: box.bottom - top};
  });
  const covers = [...over, coverOf({height})];
  const view = fitTo(createViewport(width, height), bounds, undefined, covers);
  const place = ({x, y}) => [screenX(view, x), screenY(view, y)];
  const far = (zone) => robots.every(({x, y}) =>
    Math.hypot(x - zone.x, y - zone.y) * view.scale > 30);
  return zones.filter(far).map(place).find(([x, y]) =>
    x > 0 && y > 0 && x < width && y < height) ?? null;
}"""
"""Where the first of some zones is, with the code that the map itself is drawn by."""
