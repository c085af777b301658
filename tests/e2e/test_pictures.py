"""How the pages look, held against pictures: a wrong theme or a lost map is no detail.

A real ``iveg serve`` gives pages and lists over a history that is made here; what is
live is one recorded snapshot (``frozen.json``: a run of the emulator, shortened, with
one person set to *seen*), played to the page in place of ``/live``, and the clock
of the page stands at its moment.  ``IVEG_BASELINES=write`` makes the pictures anew.

Pictures are compared as mosaics of squares of 20 px, each its mean colour: what fonts
of another machine change stays within a square, what people call broken does not.
"""

import base64
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, WebSocketRoute

from iveg.adapters.history.store import Store
from iveg.domain.records import Record
from iveg.emulator.world import climate_at
from iveg.ngsi.codec import format_stamp
from iveg.pipeline.record import Waiting
from tests.e2e.reading import evaluate
from tests.fakes.records import (
    alert_record,
    climate_record,
    command_record,
    decision_record,
    detection_record,
    odometry_record,
)
from tests.processes import Site, site

pytestmark = pytest.mark.e2e

HERE = Path(__file__).parent
NOW = 1_795_231_880.2
"""When the snapshot was taken: 04:31:20 in Madrid on 21 November 2026."""
SQUARE_PX = 20
MOST_OF_A_SQUARE = 48.0
"""Of 255; measured: noise of one machine 0 to 4, the mildest defect below 85."""
MOST_ON_AVERAGE = 6.0
WRITING = os.environ.get("IVEG_BASELINES") == "write"


@dataclass(frozen=True, slots=True)
class Case:
    """One picture."""

    name: str
    route: str
    width: int
    height: int
    theme: str
    language: str
    ready: str


CASES = (
    Case("live", "/", 1440, 900, "light", "es", "#map-fit:enabled"),
    Case("live-tablet", "/", 768, 1024, "dark", "es", "#map-fit:enabled"),
    Case("live-phone", "/", 390, 844, "sunlight", "en", "#map-fit:enabled"),
    Case("alerts", "/alerts", 1440, 900, "light", "es", "#past-rows tbody tr"),
    Case("decision", "/decisions/D1", 390, 844, "light", "es", ".chain li"),
    Case("commands", "/commands", 768, 1024, "dark", "en", "#orders-rows tbody tr"),
    Case("fleet", "/fleet", 1440, 900, "light", "en", "#machines tbody tr"),
    Case("climate", "/climate", 768, 1024, "sunlight", "es", "#trend-co2 .main-svg"),
    Case("history", "/history", 1440, 900, "dark", "es", "#chart-stops .main-svg"),
    Case("settings", "/settings", 390, 844, "light", "es", "#class-save"),
)


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server over a history that never changes; no robot is there."""
    with site(tmp_path_factory.mktemp("pictures")) as place:
        store = Store(place.settings["IVEG_DATABASE_URL"])
        rows = enumerate(_history(), 1)
        store.write([Waiting(record, n, 0.0) for n, record in rows])
        store.close()
        place.start("serve")
        place.wait_until_served()
        yield place


@pytest.fixture
def picture(browser: Browser, past: Site, case: Case) -> Iterator[Page]:
    """The page of a case, as it stands at its moment."""
    context = browser.new_context(
        viewport={"width": case.width, "height": case.height},
        locale="es-ES",
        reduced_motion="reduce",
    )
    page = context.new_page()
    page.goto(f"{past.sign_in_link}", wait_until="commit")
    looks = {"iveg_theme": case.theme, "iveg_language": case.language}
    context.add_cookies(
        [{"name": name, "value": look, "url": past.url} for name, look in looks.items()]
    )
    page.clock.install(time=NOW - 1.0)
    page.clock.pause_at(NOW)
    page.route_web_socket("**/live", _answer)
    page.route("**/api/v1/history/climate", _on_that_day)
    page.goto(past.url + case.route)
    _settle(page, case.ready)
    yield page
    context.close()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_page_looks_as_it_did(picture: Page, case: Case, judge: Page) -> None:
    shot = picture.screenshot()
    file = HERE / "baselines" / f"{case.name}.png"

    _keep(judge, shot, file)

    worst, mean = _difference(judge, shot, file.read_bytes())
    assert (worst <= MOST_OF_A_SQUARE, mean <= MOST_ON_AVERAGE) == (True, True), (
        f"{case.name}: worst square {worst:.0f}, mean {mean:.1f}"
    )


DEFECTS = {
    "a STOP is gone": "document.querySelector('#stops [data-stop=AGI]').remove()",
    "the theme is lost": "document.documentElement.dataset.theme = 'dark'",
    "the map is empty": "document.querySelector('#map').style.visibility = 'hidden'",
    "the cards are gone": "document.querySelector('#robots').replaceChildren()",
    "a panel lies over the map": "document.querySelector('#layers-panel').show()",
}


@pytest.mark.parametrize("defect", DEFECTS)
@pytest.mark.parametrize("case", CASES[:1], ids=["live"])
def test_a_real_defect_is_more_than_pictures_may_differ(
    picture: Page, judge: Page, case: Case, defect: str
) -> None:
    evaluate(picture, f"() => {{ {DEFECTS[defect]}; }}")
    baseline = (HERE / "baselines" / f"{case.name}.png").read_bytes()

    worst, _ = _difference(judge, picture.screenshot(), baseline)

    assert worst > MOST_OF_A_SQUARE


@pytest.fixture(scope="module")
def judge(browser: Browser) -> Iterator[Page]:
    """An empty page that can read pictures."""
    page = browser.new_page()
    yield page
    page.close()


def _answer(line: WebSocketRoute) -> None:
    """Plays the snapshot and its scans, and answers pings by the standing clock."""
    frozen = json.loads((HERE / "frozen.json").read_text())
    line.send(json.dumps({"topic": "snapshot", "data": frozen["snapshot"]}))
    for scan in frozen["scans"]:
        line.send(base64.b64decode(scan))

    def reply(message: str | bytes) -> None:
        data = {"t": json.loads(message).get("t"), "server": NOW}
        line.send(json.dumps({"topic": "pong", "data": data}))

    line.on_message(reply)


def _on_that_day(route: Route) -> None:
    """The last 24 hours as they were then: the server's own clock goes on."""
    since, until = (format_stamp(NOW - ago) for ago in (86_400.0, 0.0))
    route.continue_(url=f"{route.request.url}?since={since}&until={until}")


def _settle(page: Page, ready: str) -> None:
    """A little time of the page's own passes, until it shows what the case is about."""
    for _ in range(100):
        page.clock.run_for(5)
        if page.locator(ready).first.is_visible():
            break
        page.evaluate("() => fetch('/healthz')")
    for _ in range(10):
        page.clock.run_for(20)
        page.evaluate("() => fetch('/healthz')")


def _keep(judge: Page, shot: bytes, file: Path) -> None:
    if WRITING:
        url = judge.evaluate(_HALF, base64.b64encode(shot).decode())
        file.write_bytes(base64.b64decode(url.partition(",")[2]))


def _difference(judge: Page, one: bytes, other: bytes) -> tuple[float, float]:
    """How far two pictures are apart: the worst square, and the mean (of 255)."""
    texts = [base64.b64encode(picture).decode() for picture in (one, other)]
    found: Mapping[str, float] = judge.evaluate(_COMPARE, [*texts, SQUARE_PX])
    return found["worst"], found["mean"]


def _history() -> Iterator[Record]:
    """A day; nothing within a second of where the last 15 minutes begin or end.

    They are asked for by the page's clock, and ``_settle`` lets it run a little.
    """
    for n in range(2, 900, 2):
        slow = 0.5 if 300 <= n < 420 else 1.0
        for robot, speed in (("AGI", 0.8), ("AGII", 0.6)):
            yield odometry_record(
                at=NOW - 900 + n,
                robot_id=robot,
                linear=speed * slow,
                mandated_factor=slow,
            )
    for n in range(1440):
        at = NOW - 60 * (1440 - n)
        air: dict[str, Any] = {
            name: getattr(climate_at(at), name)
            for name in ("temperature", "relative_humidity", "co2")
        }
        yield climate_record(at=at, **air)
    yield from (
        detection_record(at=NOW - 60 * n - 30, probability=0.5 + n / 30)
        for n in range(15)
    )
    yield decision_record(
        started_at=NOW - 600, ended_at=NOW - 480, links=json.dumps(_CHAIN)
    )
    yield command_record(
        state="RUNNING",
        requested_at=NOW - 300,
        sent_direct_at=NOW - 299.998,
        sent_fiware_at=NOW - 299.99,
        answer_direct_at=NOW - 299.95,
        answer_fiware_at=NOW - 299.93,
        standing_at=NOW - 299.588,
        standstill_ms=412.0,
        tries=1,
    )
    yield alert_record(
        raised_at=NOW - 600,
        cleared_at=NOW - 480,
        slots='{"robot":"AGII","person":"P1","distance":1.4}',
    )


_CHAIN = [
    {"link": link, "at": NOW - 600 + n / 50, "value": value, "verdict": verdict}
    for n, (link, value, verdict) in enumerate(
        (
            ("detection", "farmer", "ok"),
            ("filter", 0.94, "ok"),
            ("geometry", 1.43, "ok"),
            ("rule", "fleet-alert 1", "ok"),
            ("feedback", "0.5", "ok"),
            ("applied", 0.5, "late"),
            ("observed", None, "missing"),
        )
    )
]
_BITMAP = """const bitmap = async (text) => createImageBitmap(
    await (await fetch('data:image/png;base64,' + text)).blob());"""
_HALF = f"""async (text) => {{
  {_BITMAP}
  const image = await bitmap(text);
  const canvas = document.createElement('canvas');
  canvas.width = image.width / 2;
  canvas.height = image.height / 2;
  const context = canvas.getContext('2d');
  context.imageSmoothingQuality = 'high';
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return canvas.toDataURL('image/png');
}}"""
"""A picture of half the size: small in the repository, large enough for people."""
_COMPARE = f"""async ([one, other, square]) => {{
  {_BITMAP}
  const images = await Promise.all([one, other].map(bitmap));
  const width = Math.ceil(images[0].width / square);
  const height = Math.ceil(images[0].height / square);
  const [a, b] = images.map((image) => {{
    const half = new OffscreenCanvas(images[0].width / 2, images[0].height / 2);
    const drawn = half.getContext('2d');
    drawn.imageSmoothingQuality = 'high';
    drawn.drawImage(image, 0, 0, half.width, half.height);
    const {{data}} = drawn.getImageData(0, 0, half.width, half.height);
    const sums = new Float64Array(width * height * 4);
    const side = square / 2;
    for (let i = 0; i < data.length; i += 4) {{
      const x = (i / 4) % half.width, y = Math.floor(i / 4 / half.width);
      const at = 4 * (Math.floor(y / side) * width + Math.floor(x / side));
      for (let c = 0; c < 3; c += 1) sums[at + c] += data[i + c];
      sums[at + 3] += 1;
    }}
    return sums;
  }});
  let worst = 0, total = 0;
  for (let i = 0; i < a.length; i += 4) {{
    let gap = 0;
    for (let c = 0; c < 3; c += 1) gap += Math.abs(a[i + c] - b[i + c]) / a[i + 3] / 3;
    worst = Math.max(worst, gap);
    total += gap;
  }}
  return {{worst, mean: (4 * total) / a.length}};
}}"""
"""Both at half size, square by square."""
