"""The browser of the tests: the system's Chromium, or Playwright's own without one.

Chromium's headless shell is taken first: without the windows of the whole browser, a
page opens at less than half the cost.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import which

from playwright.sync_api import Browser, BrowserContext, sync_playwright

from tests.patience import AGAIN
from tests.processes import Site

FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


def chromium() -> str | None:
    """Where the system's is; None without one, or where a snap confines it."""
    shell = which("chromium-headless-shell")
    if shell is not None:
        return shell
    found = which("chromium")
    is_snap = found is not None and Path(found).resolve().name == "snap"
    return None if is_snap else found


@contextmanager
def running_browser() -> Iterator[Browser]:
    """One that ends with the block.

    Playwright's synchronous driver keeps an event loop of its own in the thread, so it
    ends before asynchronous tests begin elsewhere.
    """
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
        yield found
        found.close()


def sign_in(context: BrowserContext, place: Site) -> None:
    """Sign a browser in as the link's page does."""
    context.request.post(
        f"{place.url}/signin",
        data=place.proof,
        headers=place.own_page,
        max_retries=AGAIN,
    )
