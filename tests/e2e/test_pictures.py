"""How the pages look, held against pictures: a wrong theme or a lost map is no detail.

A real ``iveg serve`` gives pages and lists over a history that is made here; what is
live is one recorded snapshot (``frozen.json``: a run of the emulator, shortened, with
one person set to *seen*), played to the page in place of ``/live``, and the clock
of the page stands at its moment.  ``IVEG_BASELINES=write`` makes the pictures anew.

Pictures are compared as mosaics of squares of 20 px, each its mean colour: what fonts
of another machine change stays within a square, what people call broken does not.
"""

import base64
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from tests.e2e.frozen import frozen_page, past_site, settle
from tests.e2e.reading import evaluate
from tests.processes import Site

pytestmark = pytest.mark.e2e

HERE = Path(__file__).parent
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

    @contextmanager
    def page(self, browser: Browser, past: Site) -> Iterator[Page]:
        """It, as it stands at its moment."""
        size = (self.width, self.height)
        with frozen_page(browser, past, size, self.theme, self.language) as page:
            page.goto(past.url + self.route)
            settle(page, self.ready)
            yield page


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
    with past_site(tmp_path_factory.mktemp("pictures")) as place:
        yield place


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_page_looks_as_it_did(
    browser: Browser, past: Site, case: Case, judge: Page
) -> None:
    with case.page(browser, past) as page:
        shot = page.screenshot()
    file = HERE / "baselines" / f"{case.name}.png"

    _keep(judge, shot, file)

    worst, mean = _difference(judge, shot, file.read_bytes())
    assert (worst <= MOST_OF_A_SQUARE, mean <= MOST_ON_AVERAGE) == (True, True), (
        f"{case.name}: worst square {worst:.0f}, mean {mean:.1f}"
    )


DEFECTS = {
    "a STOP is gone": (
        "style.display = 'none'",
        "style.display = ''",
        "#stops [data-stop=AGI]",
    ),
    "the theme is lost": (
        "dataset.theme = 'dark'",
        "dataset.theme = 'light'",
        "html",
    ),
    "the map is empty": (
        "style.visibility = 'hidden'",
        "style.visibility = ''",
        "#map",
    ),
    "the cards are gone": ("style.display = 'none'", "style.display = ''", "#robots"),
    "a panel lies over the map": ("show()", "close()", "#layers-panel"),
}
"""What goes wrong with which part, and how it is mended."""


def test_a_real_defect_is_more_than_pictures_may_differ(
    browser: Browser, past: Site, judge: Page
) -> None:
    case = CASES[0]
    baseline = (HERE / "baselines" / f"{case.name}.png").read_bytes()
    with case.page(browser, past) as page:
        found = {name: _worst_with(page, judge, baseline, name) for name in DEFECTS}
        whole, _ = _difference(judge, page.screenshot(), baseline)

    assert min(found.values()) > MOST_OF_A_SQUARE, found
    assert whole <= MOST_OF_A_SQUARE


def _worst_with(page: Page, judge: Page, baseline: bytes, defect: str) -> float:
    """The worst square while a part is spoilt."""
    spoil, mend, part = DEFECTS[defect]
    evaluate(page, f"() => {{ document.querySelector('{part}').{spoil}; }}")
    worst, _ = _difference(judge, page.screenshot(), baseline)
    evaluate(page, f"() => {{ document.querySelector('{part}').{mend}; }}")
    return worst


@pytest.fixture(scope="module")
def judge(browser: Browser) -> Iterator[Page]:
    """An empty page that can read pictures."""
    page = browser.new_page()
    yield page
    page.close()


def _keep(judge: Page, shot: bytes, file: Path) -> None:
    if WRITING:
        url = judge.evaluate(_HALF, base64.b64encode(shot).decode())
        file.write_bytes(base64.b64decode(url.partition(",")[2]))


def _difference(judge: Page, one: bytes, other: bytes) -> tuple[float, float]:
    """How far two pictures are apart: the worst square, and the mean (of 255)."""
    texts = [base64.b64encode(picture).decode() for picture in (one, other)]
    found: Mapping[str, float] = judge.evaluate(_COMPARE, [*texts, SQUARE_PX])
    return found["worst"], found["mean"]


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
