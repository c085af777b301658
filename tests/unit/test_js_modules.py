"""The front end's own modules, tested where they run: in a browser."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from iveg.web.pages.drawing import limits_text
from tests.browsers import running_browser

_ROOT = Path(__file__).parents[2]
_MODULES = sorted(path.name for path in (_ROOT / "tests/js").glob("*.test.js"))
_POLICY = (
    "default-src 'self'; img-src data:; connect-src 'self' {connect}; "
    "require-trusted-types-for 'script'"
)
_PAGE = (
    "<!doctype html><html lang=en><link rel=icon href=data:,>"
    "<link rel=stylesheet href=/static/css/tokens.css>"
    f"<body data-limits='{limits_text()}'></body></html>"
).encode()


class Files(SimpleHTTPRequestHandler):
    """The repository's files, under the policy that the dashboard sends.

    Args:
        connect: Where else than here a page may connect to.
    """

    def __init__(self, *args: Any, directory: str, connect: str = "") -> None:
        self._policy = _POLICY.format(connect=connect)
        super().__init__(*args, directory=directory)

    def do_GET(self) -> None:
        """An empty page at the root, files below it."""
        if self.path == "/":
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(_PAGE)
        else:
            super().do_GET()

    def translate_path(self, path: str) -> str:
        """Static files are where the dashboard has them, too."""
        at_home = f"/iveg{path}" if path.startswith("/static/") else path
        return super().translate_path(at_home)

    def end_headers(self) -> None:
        self.send_header("Content-Security-Policy", self._policy)
        super().end_headers()

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Says nothing."""


@contextmanager
def served(connect: str = "") -> Iterator[str]:
    """The address of these files."""
    handler = partial(Files, directory=str(_ROOT), connect=connect)
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = Thread(target=server.serve_forever, name="files")
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture(scope="module")
def files() -> Iterator[str]:
    with served() as address:
        yield address


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as found:
        yield found


@pytest.fixture
def page(browser: Browser, files: str) -> Iterator[Page]:
    """An empty page of the right origin; it may not complain."""
    complaints: list[str] = []
    opened = browser.new_page()
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.on("console", lambda said: complaints.append(said.text))
    opened.goto(files)
    yield opened
    opened.close()
    assert complaints == []


def test_there_are_modules_to_test() -> None:
    assert len(_MODULES) >= 8


@pytest.mark.parametrize("module", _MODULES)
def test_every_fact_of_the_module_holds(page: Page, module: str) -> None:
    results = page.evaluate(
        """async (module) => {
            await import(`/tests/js/${module}`);
            const {run} = await import('/tests/js/harness.js');
            return run();
        }""",
        module,
    )

    failed = [f"{it['name']}: {it['error']}" for it in results if it["error"]]
    assert failed == []
    assert results
