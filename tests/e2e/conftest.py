"""A real browser before a real iVeg, its parts in processes of their own."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, ViewportSize

from tests.browsers import running_browser, sign_in
from tests.e2e.slowly import draw_slowly
from tests.patience import PATIENCE_MS
from tests.processes import EMULATOR, Site, site

_BUSY = "503 (Service Unavailable)"
"""What a browser says of a server that says that it is busy."""
OpenPage = Callable[..., Page]


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """One for all modules in a row; each test has pages of its own, and closes them."""
    with running_browser() as found:
        yield found


@contextmanager
def driving_site(
    directory: Path, scenario: str = "demo", **settings: str
) -> Iterator[Site]:
    """FIWARE, dashboard and emulator, driving."""
    with site(directory, **settings) as place:
        place.serve()
        place.start(*EMULATOR, "--scenario", scenario)
        place.wait_until_live()
        yield place


@pytest.fixture(scope="module")
def scenario() -> str:
    """What the robots and people of a module do."""
    return "demo"


@pytest.fixture(scope="module")
def settings() -> dict[str, str]:
    """Settings of a module's iVeg."""
    return {}


@pytest.fixture(scope="module")
def stack(
    tmp_path_factory: pytest.TempPathFactory, scenario: str, settings: dict[str, str]
) -> Iterator[Site]:
    """FIWARE, dashboard and emulator, driving; shared by the tests of a module."""
    with driving_site(tmp_path_factory.mktemp("iveg"), scenario, **settings) as place:
        yield place


@pytest.fixture
def open_page(
    browser: Browser, stack: Site, request: pytest.FixtureRequest
) -> Iterator[OpenPage]:
    """Opens a signed-in page; at the end no page may have complained.

    A test that takes the server away opens its page with ``alone=True``: a browser
    then rightly says so.
    """
    complaints: list[str] = []
    slowly = request.node.get_closest_marker("full_speed") is None
    with ExitStack() as pages:

        def open_one(
            width: int = 1440,
            height: int = 900,
            locale: str = "es-ES",
            route: str = "/",
            *,
            alone: bool = False,
        ) -> Page:
            heard = None if alone else complaints
            size = (width, height)
            return pages.enter_context(
                opened(browser, stack, heard, size, locale, route, slowly=slowly)
            )

        yield open_one
    assert complaints == []


@contextmanager
def opened(
    browser: Browser,
    stack: Site,
    complaints: list[str] | None,
    size: tuple[int, int] = (1440, 900),
    locale: str = "es-ES",
    route: str = "/",
    *,
    slowly: bool = False,
) -> Iterator[Page]:
    """A signed-in page in a window of its own; what its console says is noted."""
    viewport: ViewportSize = {"width": size[0], "height": size[1]}
    with browser.new_context(viewport=viewport, locale=locale) as context:
        context.set_default_timeout(PATIENCE_MS)
        if slowly:
            draw_slowly(context)
        page = context.new_page()
        if complaints is not None:
            _listen(page, complaints)
        # As the link does, without the page that it ends on.
        sign_in(context, stack)
        page.goto(stack.url + route)
        yield page


@contextmanager
def live_page(
    browser: Browser, stack: Site, *robots: str, route: str = "/"
) -> Iterator[Page]:
    """A page in Spanish on a desktop for several tests, these robots LIVE on it."""
    complaints: list[str] = []
    with opened(browser, stack, complaints, route=route) as page:
        for robot in robots:
            page.wait_for_selector(f'[data-robot="{robot}"][data-link="LIVE"]')
        yield page
    assert complaints == []


@pytest.fixture
def page(open_page: OpenPage) -> Page:
    """The live page in Spanish on a desktop, both robots LIVE."""
    live = open_page()
    for robot in ("AGI", "AGII"):
        live.wait_for_selector(f'[data-robot="{robot}"][data-link="LIVE"]')
    return live


@pytest.fixture
def shoot() -> Callable[[Page, str], None]:
    """Leaves a picture for people, where ``IVEG_SCREENS`` names a folder for them."""
    wanted = os.environ.get("IVEG_SCREENS")

    def take(page: Page, name: str) -> None:
        if wanted:
            page.screenshot(path=Path(wanted) / f"{name}.png", full_page=True)

    return take


def _listen(page: Page, complaints: list[str]) -> None:
    def take(said: ConsoleMessage) -> None:
        if said.type in ("error", "warning") and _BUSY not in said.text:
            complaints.append(said.text)

    page.on("console", take)
    page.on("pageerror", lambda error: complaints.append(str(error)))
