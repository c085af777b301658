"""The page without a connection: one honest sentence."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from hashlib import sha256
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from playwright.sync_api import Browser, expect

from iveg.domain.limits import LIMITS
from iveg.web.security.headers import CONTENT_SECURITY_POLICY
from tests.browsers import running_browser
from tests.e2e.reading import serious

STATIC = Path(__file__).parents[4] / "iveg" / "static"
_PAGE = (
    b"<!doctype html><link rel=icon href=data:,><script type=module"
    b" src=/static/js/register.js></script><p>open</p>"
)
_REGISTER = b"import {registerWorker} from './core/install.js'; registerWorker();"


class Served(SimpleHTTPRequestHandler):
    """The static files and the worker, under the policy of the dashboard."""

    def do_GET(self) -> None:
        """Pages are made here, files come from the package."""
        made = {
            "/": (_PAGE, "text/html"),
            "/settings": (_PAGE, "text/html"),
            "/healthz": (b"ok", "text/plain"),
            "/static/js/register.js": (_REGISTER, "text/javascript"),
            "/sw.js": ((STATIC / "sw.js").read_bytes(), "text/javascript"),
        }
        body, kind = made.get(self.path, (b"", ""))
        if not kind:
            self.path = self.path.removeprefix("/static")
            return super().do_GET()
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.end_headers()
        self.wfile.write(body)
        return None

    def end_headers(self) -> None:
        self.send_header("Content-Security-Policy", CONTENT_SECURITY_POLICY)
        # As iVeg does: what the browser keeps by itself is no help without a server.
        self.send_header("Cache-Control", "no-cache")
        super().end_headers()

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the base's
        """Say nothing."""


@pytest.fixture
def browser() -> Iterator[Browser]:
    with running_browser() as found:
        yield found


@pytest.fixture
def server() -> Iterator[ThreadingHTTPServer]:
    with _serving(0) as found:
        yield found


@contextmanager
def _serving(port: int) -> Iterator[ThreadingHTTPServer]:
    handler = partial(Served, directory=str(STATIC))
    with ThreadingHTTPServer(("127.0.0.1", port), handler) as found:
        Thread(target=found.serve_forever, daemon=True).start()
        yield found
        found.shutdown()


def test_without_a_server_a_page_says_so_in_the_house_s_type_until_it_is_back(
    browser: Browser, server: ThreadingHTTPServer
) -> None:
    url = f"http://127.0.0.1:{server.server_port}"
    page = browser.new_page()
    page.goto(f"{url}/")
    page.evaluate("() => navigator.serviceWorker.ready.then(() => true)")
    page.context.add_cookies([{"name": "iveg_language", "value": "en", "url": url}])
    server.shutdown()
    server.server_close()
    page.goto(f"{url}/settings")

    said = page.inner_text("body")
    assert "use the red button" in said
    assert "use la seta roja" not in said
    limits = [LIMITS.feedback_slow_s, LIMITS.feedback_stand_s]
    told = re.findall(r"after ([\d.]+) s", said)
    assert [float(seconds) for seconds in told] == limits
    ground = page.locator("h1:visible").evaluate(_GROUND)
    assert ground == page.evaluate(_ALERT_1)
    api = page.evaluate("() => fetch('/api/v1/robots').catch((e) => e.name)")
    assert api == "TypeError"
    assert serious(page) == []

    with _serving(server.server_port):
        expect(page.get_by_text("open", exact=True)).to_be_visible()


def test_a_changed_part_of_the_offline_page_reaches_every_device() -> None:
    """Devices fetch the parts anew when the worker itself has changed."""
    worker = (STATIC / "sw.js").read_text()
    parts = ("offline.html", "css/tokens.css", "css/offline.css", "js/offline.js")
    digest = sha256(b"".join((STATIC / part).read_bytes() for part in parts))

    assert f'"iveg-offline-{digest.hexdigest()[:8]}"' in worker


_GROUND = "(one) => getComputedStyle(one).backgroundColor"
_ALERT_1 = """() => {
  const one = document.createElement('i');
  one.style.background = 'var(--alert-1)';
  document.body.append(one);
  return getComputedStyle(one).backgroundColor;
}"""
"""The red of alerts, as the house's tokens say it."""
