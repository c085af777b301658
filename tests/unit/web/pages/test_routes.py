"""Pages: who gets which, in which language and look, and with what in them."""

import re
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace

import httpx
import pytest
from fastapi import FastAPI

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.parameters import ByClass
from iveg.web.pages.contexts import Site
from iveg.web.pages.drawing import Pages
from iveg.web.pages.routes import router
from iveg.web.pages.sentences import read_sentences
from iveg.web.problems import NotSignedInError, install
from iveg.web.security.headers import Bounds
from iveg.web.security.roles import Principal

Client = httpx.AsyncClient

ROUTES = (
    "/",
    "/alerts",
    "/commands",
    "/history",
    "/fleet",
    "/climate",
    "/latency",
    "/settings",
    "/decisions",
    "/decisions/d-1",
    "/commands/c-1",
    "/about",
)
SITE = Site(
    greenhouse="Almería <b>1</b>", robots=("AGI", "AGII"), version="9.8.7", demo=True
)


@dataclass
class FakeAuthenticator:
    """Lets in whom it is told to."""

    visitor: Principal | None = None

    def authorise(self, _request: object, _action: object) -> Principal:
        if self.visitor is None:
            raise NotSignedInError
        return self.visitor

    def identify(self, _: object) -> Principal | None:
        return self.visitor


@pytest.fixture
def authenticator() -> FakeAuthenticator:
    return FakeAuthenticator(Principal("Ana <i>", "operator"))


@pytest.fixture
async def browser(authenticator: FakeAuthenticator) -> AsyncIterator[Client]:
    pages = Pages(SITE)
    app = FastAPI(docs_url=None, redoc_url=None)
    app.state.authenticator = authenticator
    app.include_router(
        router(
            pages,
            rule=lambda: replace(
                DetectionRule(), threshold=ByClass(0.75), radius_m=ByClass(2.5)
            ),
        )
    )
    install(app, pages.problem)
    transport = httpx.ASGITransport(app=Bounds(app))
    headers = {"Accept": "text/html"}
    async with Client(
        transport=transport, base_url="http://iveg", headers=headers
    ) as client:
        yield client


def stops(html: str) -> list[str]:
    return re.findall(r'data-stop="([^"]+)"', html)


@pytest.mark.parametrize("path", [*ROUTES, "/nowhere"])
async def test_every_page_has_each_stop_once_and_no_inline_script_or_style(
    browser: Client, path: str
) -> None:
    html = (await browser.get(path)).text
    assert stops(html) == ["AGI", "AGII", "fleet"]
    assert re.findall(r"<script(?![^>]* src=)|<style|\sstyle=|\son[a-z]+=", html) == []
    assert "http://" not in html


async def test_a_stranger_is_told_how_to_get_in(
    browser: Client, authenticator: FakeAuthenticator
) -> None:
    authenticator.visitor = None
    answer = await browser.get("/")
    assert answer.status_code == 401
    assert "/signin#token=" in answer.text
    assert stops(answer.text) == []


@pytest.mark.parametrize(
    ("accepts", "cookie", "language"),
    [
        ("de", "", "es"),
        ("en-GB,es;q=0.5", "", "en"),
        ("en", "iveg_language=es", "es"),
    ],
)
async def test_a_page_speaks_the_remembered_language_or_the_browsers(
    browser: Client, accepts: str, cookie: str, language: str
) -> None:
    headers = {"Accept-Language": accepts, "Cookie": cookie}
    answer = await browser.get("/", headers=headers)
    assert f'<html lang="{language}"' in answer.text
    assert read_sentences(language).say("stop.loading", {}) in answer.text


@pytest.mark.parametrize(
    ("cookie", "look"),
    [
        ("iveg_theme=sunlight; iveg_palette=paper", ("sunlight", "paper")),
        ('iveg_theme="><script>', ("auto", "iveg")),
    ],
)
async def test_the_remembered_look_comes_with_the_page_and_a_made_up_one_does_not(
    browser: Client, cookie: str, look: tuple[str, str]
) -> None:
    answer = await browser.get("/", headers={"Cookie": cookie})
    assert 'data-theme="{}" data-palette="{}"'.format(*look) in answer.text


async def test_about_says_what_stop_is_not_and_tells_the_rule(browser: Client) -> None:
    html = (await browser.get("/about", headers={"Accept-Language": "en"})).text
    assert "It is not an emergency stop and not certified." in html
    assert "not an ISO 13850 device" in html
    assert "75%" in html
    assert "2.5 m" in html


@pytest.mark.parametrize(
    ("old", "new"), [("/what-if", "/settings"), ("/docs", "/openapi.json")]
)
async def test_the_address_of_a_page_that_is_gone_leads_on(
    browser: Client, old: str, new: str
) -> None:
    assert (await browser.get(old)).headers["location"] == new


async def test_release_and_resume_stand_apart_from_stop(browser: Client) -> None:
    html = (await browser.get("/")).text
    strip = html[html.index('id="stops"') : html.index("</header>")]
    assert "data-release" not in strip
    assert re.findall(r'data-release="(\w+)"', html) == ["AGI", "AGII"]
    assert re.findall(r'data-resume="(\w+)"', html) == ["AGI", "AGII"]


@pytest.mark.parametrize("kind", ["decision", "command"])
async def test_names_and_ids_from_outside_are_text_and_not_markup(
    browser: Client, kind: str
) -> None:
    html = (await browser.get(f'/{kind}s/"><img src=x>')).text
    assert f'data-{kind}="&#34;&gt;&lt;img src=x&gt;"' in html
    assert "Ana &lt;i&gt;" in html
    assert "Almería &lt;b&gt;1&lt;/b&gt;" in html
