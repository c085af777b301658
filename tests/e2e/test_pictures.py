"""How the pages look, held against pictures: a wrong theme or a lost map is no detail.

A real ``iveg serve`` gives pages and lists over a history that is made here; what is
live is one recorded snapshot (``frozen.json``: a run of the emulator, shortened, with
one person set to *seen*), played to the page in place of ``/live``, and the clock
of the page stands at its moment.  ``IVEG_BASELINES=write`` makes the pictures anew.

Pictures are compared as mosaics of squares of 20 px, each its mean colour: what fonts
of another machine change stays within a square, what people call broken does not.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Page

from iveg.domain.limits import LIMITS
from iveg.models.snapshot import Snapshot
from tests.e2e.frozen import frozen, frozen_page, past_site, settle
from tests.e2e.reading import evaluate
from tests.processes import Site

pytestmark = pytest.mark.e2e

HERE = Path(__file__).parent
SQUARE_PX = 20
MOST_OF_A_SQUARE = 48.0
"""Of 255; measured: noise of one machine 0 to 4, the mildest defect below 85."""
MOST_ON_AVERAGE = 6.0
WRITING = os.environ.get("IVEG_BASELINES") == "write"


class Difference(NamedTuple):
    """Between two pictures: the worst square, the mean (of 255), where that is (px)."""

    worst: float
    mean: float
    place: tuple[int, int]


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
    Case("history", "/history", 1440, 900, "sunlight", "es", "#chart-stops .main-svg"),
    Case("settings", "/settings", 390, 844, "light", "es", "#rule-form"),
)


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server over a history that never changes; no robot is there."""
    with past_site(tmp_path_factory.mktemp("pictures")) as place:
        yield place


def test_the_recorded_snapshot_is_one_that_a_server_may_send() -> None:
    told = frozen()["snapshot"]

    assert Snapshot.model_validate(told).model_dump(mode="json") == told


def test_no_margin_of_the_recorded_snapshot_is_known_from_old_data() -> None:
    told = frozen()["snapshot"]
    shown = [one["margin"] for one in (*told["robots"], *told["people"])]
    worst = told["health"]["safety"]["worst_margin"]["margin"]

    known = [one for one in (*shown, worst) if one and one["band"] != "unknown"]
    assert worst in known
    for one in known:
        reacts_s = max(LIMITS.reaction_s, one["age_s"] + LIMITS.onward_s)
        walks_m = one["parts"]["person_walks_m"]
        assert one["age_s"] <= LIMITS.seen_s
        assert walks_m >= LIMITS.walking_m_s * reacts_s - 0.01


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_page_looks_as_it_did(browser: Browser, past: Site, case: Case) -> None:
    file = HERE / "baselines" / f"{case.name}.png"
    with case.page(browser, past) as page:
        _keep(_still(page), file)
        found = _nearest(page, file)

    assert found.worst <= MOST_OF_A_SQUARE, found
    assert found.mean <= MOST_ON_AVERAGE, found


DEFECTS = {
    "a STOP is gone": ("#stops [data-stop=AGI]", "style.display = 'none'"),
    "the theme is lost": ("html", "dataset.theme = 'dark'"),
    "the map is empty": ("#map", "style.visibility = 'hidden'"),
    "the cards are gone": ("#robots", "style.display = 'none'"),
    "a panel lies over the map": ("#layers-panel", "show()"),
}
"""Which part, and what goes wrong with it."""
MENDED = {
    "style.display = 'none'": "style.display = ''",
    "dataset.theme = 'dark'": "dataset.theme = 'light'",
    "style.visibility = 'hidden'": "style.visibility = ''",
    "show()": "close()",
}


@pytest.fixture(scope="module")
def spoilable(browser: Browser, past: Site) -> Iterator[Page]:
    """The live page; who spoils it mends it, and the next looks whether it is whole."""
    with CASES[0].page(browser, past) as page:
        yield page


@pytest.mark.parametrize("defect", DEFECTS)
def test_a_real_defect_is_more_than_pictures_may_differ(
    spoilable: Page, defect: str
) -> None:
    baseline = HERE / "baselines" / f"{CASES[0].name}.png"
    part, spoil = DEFECTS[defect]
    whole = _nearest(spoilable, baseline)
    _do(spoilable, part, spoil)
    spoilt = _difference(spoilable.screenshot(), baseline)
    _do(spoilable, part, MENDED[spoil])

    assert whole.worst <= MOST_OF_A_SQUARE, whole
    assert spoilt.worst > MOST_OF_A_SQUARE, spoilt


def _do(page: Page, part: str, change: str) -> None:
    evaluate(page, f"() => {{ document.querySelector('{part}').{change}; }}")


def _nearest(picture: Page, baseline: Path) -> Difference:
    """How far the page is from a picture; a map's worker may have to draw it yet."""
    for _ in range(50):
        found = _difference(picture.screenshot(), baseline)
        if found.worst <= MOST_OF_A_SQUARE and found.mean <= MOST_ON_AVERAGE:
            break
        picture.evaluate("() => fetch('/healthz')")
    return found


def _still(picture: Page) -> bytes:
    """The page when nothing on it has changed from one picture to the next."""
    shots = [b"", picture.screenshot()] if WRITING else [b"", b""]
    while shots[-1] != shots[-2]:
        shots.append(picture.screenshot())
    return shots[-1]


def _keep(shot: bytes, file: Path) -> None:
    if WRITING:
        _half(shot).save(file, optimize=True)


def _difference(shot: bytes, file: Path) -> Difference:
    """How far two pictures are apart."""
    with Image.open(file) as baseline:
        gaps = np.abs(_mosaic(_half(shot)) - _mosaic(baseline.convert("RGB")))
    squares = gaps.mean(axis=2)
    row, column = np.unravel_index(squares.argmax(), squares.shape)
    place = int(column) * SQUARE_PX, int(row) * SQUARE_PX
    return Difference(float(squares.max()), float(squares.mean()), place)


def _half(shot: bytes) -> Image.Image:
    """A picture of half the size: small in the repository, large enough for people."""
    with Image.open(BytesIO(shot)) as picture:
        return picture.convert("RGB").reduce(2)


def _mosaic(half: Image.Image) -> NDArray[np.float32]:
    """The mean colour of each square; shape (rows, columns, 3), 0 to 255."""
    return np.asarray(half.reduce(SQUARE_PX // 2), np.float32)
