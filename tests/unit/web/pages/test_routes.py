"""Pages: who gets which, in which language and look, and with what in them."""

import re
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace

import httpx
import pytest
from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from iveg.domain.detection_rule import DetectionRule
from iveg.web.errors import NotSignedInError
from iveg.web.pages.contexts import Page, Site
from iveg.web.pages.drawing import Pages
from iveg.web.pages.openapi import (
    AnswerDoc,
    ApiDoc,
    CallDoc,
    FieldDoc,
    GroupDoc,
    ShapeDoc,
)
from iveg.web.pages.routes import router
from iveg.web.pages.translations import read_translations
from iveg.web.problems import install
from iveg.web.security.headers import CONTENT_SECURITY_POLICY, SecurityHeaders
from iveg.web.security.roles import Principal

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
    "/docs",
    "/about",
)
SITE = Site(
    greenhouse="Almería <b>1</b>",
    robots=("AGI", "AGII"),
    version="9.8.7",
    demo=True,
)

API = ApiDoc(
    "iVeg",
    "9.8.7",
    (
        GroupDoc(
            "robots",
            (
                CallDoc(
                    "post",
                    "/api/v1/robots/{robot_id}/stop",
                    "post-stop",
                    "stop",
                    "Ask one robot to halt.",
                    "Never refused.\n\nRepeated presses join.",
                    (FieldDoc("robot_id", "text", "path", required=True),),
                    "StopBody",
                    (AnswerDoc("202", "Taken", "Pressed"),),
                ),
            ),
        ),
    ),
    (ShapeDoc("Pressed", "What was made.", (FieldDoc("state", "text"),)),),
)


@dataclass
class FakeAuthenticator:
    """Lets in whom it is told to."""

    visitor: Principal | None = None
    left: int = 0

    def sign_out(self, _: object) -> Response:
        self.left += 1
        return RedirectResponse("/", 303)

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
async def browser(authenticator: FakeAuthenticator) -> AsyncIterator[httpx.AsyncClient]:
    pages = Pages(SITE)
    app = FastAPI(docs_url=None, redoc_url=None)
    app.state.authenticator = authenticator
    app.include_router(
        router(
            pages,
            document=lambda: API,
            rule=lambda: replace(DetectionRule(), threshold=0.75, radius_m=2.5),
        )
    )
    install(app, pages.problem)
    transport = httpx.ASGITransport(app=SecurityHeaders(app))
    headers = {"Accept": "text/html"}
    async with httpx.AsyncClient(
        transport=transport, base_url="http://iveg", headers=headers
    ) as client:
        yield client


def stops(html: str) -> list[str]:
    return re.findall(r'data-stop="([^"]+)"', html)


@pytest.mark.parametrize("path", [*ROUTES, "/nowhere"])
async def test_every_page_of_somebody_signed_in_has_each_stop_once(
    browser: httpx.AsyncClient, path: str
) -> None:
    answer = await browser.get(path)
    assert stops(answer.text) == ["AGI", "AGII", "fleet"]


@pytest.mark.parametrize("path", ROUTES)
async def test_a_stranger_is_told_how_to_get_in(
    browser: httpx.AsyncClient, authenticator: FakeAuthenticator, path: str
) -> None:
    authenticator.visitor = None
    answer = await browser.get(path)
    assert answer.status_code == 401
    assert "/signin#token=" in answer.text
    assert stops(answer.text) == []


async def test_the_way_in_is_open_to_strangers(
    browser: httpx.AsyncClient, authenticator: FakeAuthenticator
) -> None:
    authenticator.visitor = None
    answer = await browser.get("/signin")
    assert answer.status_code == 200
    assert "/signin#token=" in answer.text


async def test_a_page_that_is_not_there_says_so_in_words(
    browser: httpx.AsyncClient,
) -> None:
    answer = await browser.get("/nowhere")
    assert answer.status_code == 404
    assert "Esta página no existe." in answer.text


async def test_spanish_is_what_readers_of_no_known_language_get(
    browser: httpx.AsyncClient,
) -> None:
    answer = await browser.get("/", headers={"Accept-Language": "de"})
    assert '<html lang="es"' in answer.text
    assert read_translations("es").say("stop.loading") in answer.text


async def test_the_browsers_language_is_used(browser: httpx.AsyncClient) -> None:
    answer = await browser.get("/", headers={"Accept-Language": "en-GB,es;q=0.5"})
    assert '<html lang="en"' in answer.text
    assert read_translations("en").say("stop.loading") in answer.text


async def test_the_remembered_language_wins_over_the_browsers(
    browser: httpx.AsyncClient,
) -> None:
    headers = {"Accept-Language": "en", "Cookie": "iveg_language=es"}
    answer = await browser.get("/", headers=headers)
    assert '<html lang="es"' in answer.text


async def test_the_remembered_look_comes_with_the_page(
    browser: httpx.AsyncClient,
) -> None:
    headers = {"Cookie": "iveg_theme=sunlight; iveg_palette=paper"}
    answer = await browser.get("/", headers=headers)
    assert 'data-theme="sunlight" data-palette="paper"' in answer.text


async def test_a_made_up_look_is_ignored(browser: httpx.AsyncClient) -> None:
    headers = {"Cookie": 'iveg_theme="><script>; iveg_language=xx'}
    answer = await browser.get("/", headers=headers)
    assert '<html lang="es" data-theme="auto" data-palette="iveg">' in answer.text


@pytest.mark.parametrize("path", [*ROUTES, "/signin"])
async def test_no_page_holds_inline_script_or_style(
    browser: httpx.AsyncClient, path: str
) -> None:
    html = (await browser.get(path)).text
    assert re.findall(r"<script(?![^>]* src=)|<style|\sstyle=|\son[a-z]+=", html) == []
    # The way in names the address that was asked.
    assert "http://" not in html.replace("http://iveg", "")


async def test_names_from_outside_are_text_and_not_markup(
    browser: httpx.AsyncClient,
) -> None:
    html = (await browser.get("/")).text
    assert "Ana &lt;i&gt;" in html
    assert "Almería &lt;b&gt;1&lt;/b&gt;" in html
    assert "<b>1</b>" not in html


async def test_pages_with_figures_are_held_by_the_same_policy(
    browser: httpx.AsyncClient,
) -> None:
    for route in ("/", "/history", "/climate"):
        headers = (await browser.get(route)).headers
        assert headers["content-security-policy"] == CONTENT_SECURITY_POLICY


async def test_about_says_what_stop_is_not(browser: httpx.AsyncClient) -> None:
    html = (await browser.get("/about", headers={"Accept-Language": "en"})).text
    assert "It is not an emergency stop and not certified." in html
    assert "not an ISO 13850 device" in html


async def test_about_tells_the_rule_that_is_in_force_now(
    browser: httpx.AsyncClient,
) -> None:
    html = (await browser.get("/about", headers={"Accept-Language": "en"})).text
    assert "75%" in html
    assert "2.5 m" in html


async def test_the_api_is_drawn_from_its_own_document(
    browser: httpx.AsyncClient,
) -> None:
    html = (await browser.get("/docs")).text
    assert 'href="#post-stop"' in html
    assert 'id="post-stop"' in html
    assert "Repeated presses join." in html
    assert 'id="shape-Pressed"' in html


async def test_release_and_resume_stand_apart_from_stop(
    browser: httpx.AsyncClient,
) -> None:
    html = (await browser.get("/")).text
    strip = html[html.index('id="stops"') : html.index("</header>")]
    assert "data-release" not in strip
    assert re.findall(r'data-release="(\w+)"', html) == ["AGI", "AGII"]
    assert re.findall(r'data-resume="(\w+)"', html) == ["AGI", "AGII"]


async def test_every_page_can_be_reached_from_every_other(
    browser: httpx.AsyncClient,
) -> None:
    html = (await browser.get("/about")).text
    menu = html[html.index('id="menu"') :]
    linked = set(re.findall(r'href="(/\w*)"', menu))
    assert linked >= {path for path in ROUTES if path.count("/") == 1}


@pytest.mark.parametrize("kind", ["decision", "command"])
async def test_a_record_has_an_address_and_its_id_is_text(
    browser: httpx.AsyncClient, kind: str
) -> None:
    html = (await browser.get(f'/{kind}s/"><img src=x>')).text
    assert f'data-{kind}="&#34;&gt;&lt;img src=x&gt;"' in html


@pytest.mark.parametrize("kind", ["decision", "command"])
async def test_an_address_that_is_no_record_is_refused(
    browser: httpx.AsyncClient, kind: str
) -> None:
    assert (await browser.get(f"/{kind}s/" + "x" * 65)).status_code == 422


async def test_signing_out_ends_the_session_and_goes_to_the_way_in(
    browser: httpx.AsyncClient, authenticator: FakeAuthenticator
) -> None:
    answer = await browser.post("/signout")
    assert (answer.status_code, answer.headers["location"], authenticator.left) == (
        303,
        "/",
        1,
    )


async def test_a_stranger_has_nothing_to_sign_out_of(
    browser: httpx.AsyncClient, authenticator: FakeAuthenticator
) -> None:
    authenticator.visitor = None
    assert (await browser.post("/signout")).status_code == 401
    assert authenticator.left == 0


@pytest.mark.parametrize(
    ("language", "name", "said"),
    [
        ("es", "mvsim-20x20", "Invernadero virtual"),
        ("en", "mvsim-20x20", "Virtual greenhouse"),
        ("es", "none", "Campo abierto"),
        ("es", "Finca Sol", "Finca Sol"),
    ],
)
def test_13_16_a_greenhouse_of_iveg_has_a_name_in_the_readers_language(
    language: str, name: str, said: str
) -> None:
    pages = Pages(replace(SITE, greenhouse=name))
    scope = {
        "type": "http",
        "headers": [(b"cookie", f"iveg_language={language}".encode())],
    }
    frame = pages.frame(Request(scope), "live", Principal("ana", "operator"))

    drawn = bytes(pages.draw(Page(frame)).body).decode()

    assert f"<title>iVeg · {said}</title>" in drawn
    assert re.search(rf'brand__house">(<[^>]+>)?{re.escape(said)}', drawn)
