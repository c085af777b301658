"""The pictures of docs/dashboard.md, "Visual language".

``python -m tests.pictures.language [FOLDER]``; the folder is ``docs`` by default.
"""

import io
import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from PIL import Image
from playwright.sync_api import Page, WebSocketRoute

from tests import staged
from tests.browsers import running_browser
from tests.e2e.frozen import frozen_page, past_site, settle
from tests.pictures.scenes import IDS, fleet
from tests.staged import STAGED

SHOWN = (
    "does not slow",
    "half speed",
    "contradicts itself",
    "stopped from a page",
    "all clear",
)
"""One situation of each level of a robot that has spoken, the worst first."""
_SIZE = (1000, 760)
_LASTS_MS = 1500


def main(folder: Path) -> None:
    """Levels on the status line and on a card; ten robots on the map."""
    with running_browser() as browser, TemporaryDirectory() as directory:
        names = ",".join(IDS)
        with past_site(Path(directory), IVEG_ROBOTS=names) as past:
            told = fleet(10, "calm")
            lines: list[WebSocketRoute] = []
            with frozen_page(
                browser, past, _SIZE, "light", "en", lambda: told, lines
            ) as page:
                page.goto(past.url)
                settle(page, "#map-fit:enabled")
                robots = page.locator("#map").screenshot()
                (folder / "language-robots.png").write_bytes(robots)
                robots_told = told["snapshot"]["robots"]
                pictures = [_said(page, lines[-1], robots_told, name) for name in SHOWN]
    _stacked(pictures).save(folder / "language-levels.png", optimize=True)


def _said(
    page: Page, line: WebSocketRoute, robots: list[dict[str, Any]], name: str
) -> Image.Image:
    """The status line while the first robot is in a staged situation."""
    situation = staged.told(STAGED[name][0])
    first = {**robots[0], "situation": situation, "age_s": 0.1}
    for _ in range(0, _LASTS_MS, 200):
        for robot in (first, *robots[1:]):
            data = {"topic": f"robots/{robot['robot_id']}", "data": robot}
            line.send(json.dumps(data))
        page.evaluate("() => fetch('/healthz')")
        page.clock.run_for(200)
    return Image.open(io.BytesIO(page.locator("#status").screenshot())).convert("RGB")


def _stacked(pictures: list[Image.Image]) -> Image.Image:
    """One below the other."""
    gap_px = 6
    high = sum(one.height + gap_px for one in pictures)
    whole = Image.new("RGB", (pictures[0].width, high), "white")
    y = 0
    for one in pictures:
        whole.paste(one, (0, y))
        y += one.height + gap_px
    return whole


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs"))
