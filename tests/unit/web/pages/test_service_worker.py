"""Issue 13.23: installable, and one honest sentence without a connection."""

import json
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from playwright.sync_api import Browser

from iveg.web.pages import service_worker
from iveg.web.security.authentication import Authenticator
from iveg.web.security.headers import CONTENT_SECURITY_POLICY
from tests.browsers import running_browser
from tests.builders import START

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
        super().end_headers()

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the base's
        """Say nothing."""


async def test_the_worker_is_open_and_never_from_a_cache() -> None:
    app = FastAPI()
    app.state.authenticator = Authenticator(
        sign_in_token="cd" * 32, api_token="", clock=lambda: START
    )
    app.include_router(service_worker.router())
    transport = httpx.ASGITransport(app=app)
    async with httpx.AsyncClient(transport=transport, base_url="http://iveg") as client:
        answer = await client.get("/sw.js")

    assert answer.headers["cache-control"] == "no-cache"
    assert answer.headers["content-type"].startswith("text/javascript")


def test_the_manifest_names_icons_that_are_there() -> None:
    manifest = json.loads((STATIC / "manifest.webmanifest").read_text())

    icons = {one["sizes"]: one["src"] for one in manifest["icons"]}
    assert {"192x192", "512x512"} <= icons.keys()
    for path in icons.values():
        assert (STATIC / path.removeprefix("/static/")).is_file()


@pytest.fixture
def browser() -> Iterator[Browser]:
    with running_browser() as found:
        yield found


def test_without_a_server_a_page_says_use_the_red_button_and_api_fails_as_ever(
    browser: Browser,
) -> None:
    handler = partial(Served, directory=str(STATIC))
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    Thread(target=server.serve_forever, daemon=True).start()
    url = f"http://127.0.0.1:{server.server_port}"

    page = browser.new_page()
    page.goto(f"{url}/")
    page.evaluate("() => navigator.serviceWorker.ready.then(() => true)")
    server.shutdown()
    server.server_close()
    page.goto(f"{url}/settings")
    said = page.inner_text("body")
    api = page.evaluate("() => fetch('/api/v1/robots').catch((e) => e.name)")

    assert "use la seta roja" in said
    assert "use the red button" in said
    assert api == "TypeError"
