"""Takes the pictures: ``python -m tests.pictures [FOLDER]``.

The folder is ``test-output/pictures`` by default.  ``sheet.png`` has all thumbnails;
``found.txt`` names what a script can find wrong with them.
"""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import (
    Browser,
    Error,
    Page,
    WebSocketRoute,
)

from tests.browsers import running_browser
from tests.e2e.frozen import Frozen, frozen_page, past_site, settle
from tests.e2e.reading import (
    COVERED_STOPS,
    CUT_HEADER,
    OVERFLOW,
    RUN_OVER,
    evaluate,
)
from tests.pictures.pages import PAGES, READY, TABLETS, act, prepare
from tests.pictures.pairs import Case, covering
from tests.pictures.people import Sessions, signed_in
from tests.pictures.scenes import IDS, SITUATIONS, fleet
from tests.pictures.sheet import Picture, sheet_of
from tests.processes import Site

AT_LEAST = 200
FACTORS = {
    "robots": ("1", "2", "10"),
    "page": tuple(PAGES),
    "window": ("390x844", "844x390", "768x1024", "1024x768", "1440x900", "1920x1080"),
    "language": ("es", "en"),
    "theme": ("light", "dark", "sunlight", "forced"),
    "situation": tuple(SITUATIONS),
}
_LOST_MS = 4000
"""How long the server has been away on pictures without it."""
_REST_MS = 1600
"""Until cards have found their order, and the status line says what got better."""


def main(folder: Path) -> None:
    """All pictures, the sheet, and what was found."""
    folder.mkdir(parents=True, exist_ok=True)
    cases = sorted(covering(FACTORS, AT_LEAST), key=lambda case: case["robots"])
    pictures: list[Picture] = []
    with running_browser() as browser:
        for robots, some in groupby(cases, key=lambda case: case["robots"]):
            with _site(int(robots)) as past:
                who = signed_in(browser, past)
                for case in some:
                    taken = _take(browser, past, who, case, folder, len(pictures))
                    pictures.append(taken)
                    print(pictures[-1].said, flush=True)
    sheet_of(pictures).save(folder / "sheet.png", optimize=True)
    wrong = [one.said for one in pictures if one.found]
    (folder / "found.txt").write_text("".join(f"{said}\n" for said in wrong))
    print(f"{len(pictures)} pictures, {len(wrong)} with something found: {folder}")


@contextmanager
def _site(robots: int) -> Iterator[Site]:
    with TemporaryDirectory() as directory:
        names = ",".join(IDS[:robots])
        with past_site(Path(directory), IVEG_ROBOTS=names) as past:
            yield past


def _take(
    browser: Browser,
    past: Site,
    who: Sessions,
    case: Case,
    folder: Path,
    n: int,
) -> Picture:
    """One picture of a page that has come to rest."""
    wide, high = (int(side) for side in case["window"].split("x"))
    told = fleet(int(case["robots"]), case["situation"])
    lines: list[WebSocketRoute] = []
    errors: list[str] = []
    look = (case["theme"], case["language"])
    with frozen_page(
        browser, past, (wide, high), *look, tell=lambda: told, lines=lines
    ) as page:
        page.on("pageerror", lambda error: errors.append(str(error)))
        session = who.tablet if case["page"] in TABLETS else who.admin
        page.context.add_cookies(
            [
                {"name": one["name"], "value": one["value"], "url": past.url}
                for one in session["cookies"]
            ]
        )
        try:
            prepare(page, case["page"], told, past.url)
            page.goto(past.url + PAGES[case["page"]])
            settle(page, READY.get(case["page"], "body"))
            act(page, case["page"])
            if case["situation"] == "no server" and lines:
                _lose(page, lines)
            elif lines:
                _rest(page, lines[-1], told)
        except (AssertionError, Error) as error:
            # One page that is late, or broken, is no reason to take no more pictures.
            errors.append(str(error).splitlines()[0])
        file = folder / f"{n:03} {' '.join(case.values())}.png"
        page.screenshot(path=file)
        return Picture(n, case, file, _high(page), tuple(errors + _found(page)))


def _rest(page: Page, line: WebSocketRoute, told: Frozen) -> None:
    """Time passes until nothing moves, and every robot goes on talking."""
    for _ in range(0, _REST_MS, 200):
        for robot in told["snapshot"]["robots"]:
            said = {"topic": f"robots/{robot['robot_id']}", "data": robot}
            line.send(json.dumps(said))
        page.evaluate("() => fetch('/healthz')")
        page.clock.run_for(200)


def _lose(page: Page, lines: list[WebSocketRoute]) -> None:
    """The server goes, and is not there when the page asks again."""
    page.route_web_socket("**/live", lambda line: line.close())
    lines[-1].close()
    page.clock.run_for(_LOST_MS)


def _high(page: Page) -> int:
    found: int = page.evaluate("() => document.documentElement.scrollHeight")
    return found


def _found(page: Page) -> list[str]:
    """What is wrong at first sight of a script."""
    wide = evaluate(page, OVERFLOW)
    covered = evaluate(page, COVERED_STOPS)
    runs = evaluate(page, RUN_OVER)
    cut = evaluate(page, CUT_HEADER)
    return [
        *([f"{wide} px too wide"] if wide > 0 else []),
        *(f"covered: {stop}" for stop in covered),
        *(f"runs over: {words}" for words in runs[:2]),
        *(f"cut: {words}" for words in cut),
    ]


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "test-output/pictures"))
