"""With the system's few colours in place of ours: STOP, danger and focus are seen.

Pictures are measured: what a style sheet asks for is not what such a system shows.
"""

from collections.abc import Iterator
from io import BytesIO

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Locator, Page

from tests.e2e.frozen import frozen_page, past_site, settle
from tests.pictures.scenes import IDS, fleet
from tests.processes import Site

pytestmark = pytest.mark.e2e

_Pixels = NDArray[np.float64]
SEEN = 100.0
"""Between the brightness of two areas that anybody tells apart (of 255)."""


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server that has no robots."""
    names = ",".join(IDS[:2])
    with past_site(tmp_path_factory.mktemp("forced"), IVEG_ROBOTS=names) as place:
        yield place


@pytest.fixture(scope="module")
def page(browser: Browser, past: Site) -> Iterator[Page]:
    """Two robots, of which one does not slow down."""
    told = fleet(2, "danger")
    with frozen_page(browser, past, (1440, 900), "forced", tell=lambda: told) as found:
        found.goto(past.url)
        settle(found, "#map-fit:enabled")
        yield found


def test_a_stop_has_a_shape(page: Page) -> None:
    for name in ("AGI", "AGII", "fleet"):
        seen = _seen(page.locator(f"#stops [data-stop={name}]"))
        middle, corner = seen[seen.shape[0] // 2, 20], seen[0, 0]

        assert abs(middle - corner) > SEEN, name


def test_danger_is_not_the_ground_of_the_page(page: Page) -> None:
    status = _seen(page.locator("#status"))
    header = _seen(page.locator(".header__bar"))
    danger, other = (
        _seen(page.locator(f".card[data-robot={name}]")) for name in ("AGII", "AGI")
    )

    assert abs(np.median(status) - np.median(header)) > SEEN
    assert abs(danger[2, 40] - other[2, 40]) > SEEN


def test_the_map_is_a_picture(page: Page) -> None:
    middle = _seen(page.locator("#map"))[150:-150, 150:-150]
    tones = np.unique(middle.round(), return_counts=True)[1]

    assert (tones > 500).sum() >= 4


def test_a_focus_is_seen_on_a_stop(page: Page) -> None:
    stop = page.locator("#stops [data-stop=AGI]")
    box = stop.bounding_box()
    assert box is not None
    left, top = int(box["x"]) - 6, int(box["y"]) - 6
    around = slice(top, top + int(box["height"]) + 12), slice(left, None)
    before = _brightness(page.screenshot())[around]
    stop.focus()
    after = _brightness(page.screenshot())[around]

    assert (np.abs(after - before) > SEEN / 2).sum() > 2 * box["width"]


def _seen(part: Locator) -> _Pixels:
    return _brightness(part.screenshot())


def _brightness(png: bytes) -> _Pixels:
    return np.asarray(Image.open(BytesIO(png)).convert("L"), float)
