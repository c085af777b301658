"""HTML pages: each is one context drawn by its template, in the reader's language.

``Pages`` draws; ``router`` gives each page its address.
"""

import asyncio
import json
from collections.abc import Callable
from dataclasses import asdict, replace
from datetime import datetime
from importlib.resources import files
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Path, Request, Response
from fastapi.responses import HTMLResponse, JSONResponse
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from pydantic import Field

from iveg.adapters.passwords import LEAST, MOST
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.limits import LIMITS
from iveg.domain.stamps import format_stamp
from iveg.models.base import Body
from iveg.web import cookies
from iveg.web.pages.contexts import (
    THEMES,
    AboutPage,
    AccountPage,
    Appearance,
    DocsPage,
    ErrorPage,
    Page,
    PageFrame,
    RecordPage,
    SignInPage,
    Site,
)
from iveg.web.pages.local_time import in_madrid
from iveg.web.pages.openapi import ApiDoc
from iveg.web.pages.sentences import Sentences
from iveg.web.pages.translations import (
    LANGUAGES,
    Slot,
    Translations,
    preferred_language,
    read_translations,
)
from iveg.web.problems import Problem
from iveg.web.security.answer import AnswerOfDevice
from iveg.web.security.authentication import (
    Action,
    Principal,
    authenticator_of,
    require,
)
from iveg.web.security.single_sign_on import SingleSignOn

_RECORD_ID = Annotated[str, Path(pattern=r"^[ -~]{1,64}$")]
_EXPLAINED = (400, 401, 403, 404, 405, 429, 500, 503)
_SCRIPTED: Final = {
    "live": "/",
    "alerts": "/alerts",
    "climate": "/climate",
    "commands": "/commands",
    "decisions": "/decisions",
    "fleet": "/fleet",
    "history": "/history",
    "latency": "/latency",
    "settings": "/settings",
}
"""Pages that scripts fill, and their addresses."""

_Reader = Annotated[Principal, Depends(require("read"))]


class _ByLink(Body):
    """The token behind the ``#`` of the link."""

    token: str = Field(max_length=256)


class _ByPassword(Body):
    """Who somebody says that they are, and the proof."""

    name: str = Field(max_length=256)
    password: str = Field(max_length=MOST)


class _ByInvitation(Body):
    """An invitation, and the password that is to be."""

    invitation: str = Field(max_length=256)
    password: str = Field(min_length=LEAST, max_length=MOST)


class _ByPasskey(Body):
    """What a device answered to the challenge of ``GET /signin/passkey``."""

    passkey: AnswerOfDevice


_SignIn = _ByLink | _ByPassword | _ByInvitation | _ByPasskey
"""What the sign-in page posts."""


class Pages:
    """Draws pages; one for the life of the server.

    Args:
        site: What every page of this server has in common.
        is_ready: Whether somebody can see to who comes in; each page says where not.
    """

    def __init__(self, site: Site, is_ready: Callable[[], bool] = lambda: True) -> None:
        self._site = site
        self._is_ready = is_ready
        self._environments = {
            language: _environment(read_translations(language))
            for language in LANGUAGES
        }

    def frame(
        self, request: Request, route: str, visitor: Principal | None = None
    ) -> PageFrame:
        """The frame around a page for this reader."""
        frame = PageFrame(
            self._site, _look(request), route, unready=not self._is_ready()
        )
        if visitor is None:
            return frame
        return replace(
            frame,
            name=visitor.name,
            role=visitor.role,
            account=visitor.has_account,
            tablet=visitor.is_tablet,
        )

    def draw(self, page: Page, status: int = 200) -> HTMLResponse:
        """A page as a response.

        Args:
            page: Its context.
            status: HTTP status.
        """
        environment = self._environments[page.frame.look.language]
        html = environment.get_template(f"{page.frame.route}.html").render(page=page)
        return HTMLResponse(html, status, {"Vary": "Cookie, Accept-Language"})

    def problem(self, request: Request, problem: Problem) -> Response:
        """A problem as a page: sign-in for a stranger, an explanation for others."""
        if problem.status == 401:
            return self.sign_in(request, 401)
        known = problem.status if problem.status in _EXPLAINED else "other"
        # Somebody signed in keeps the STOP controls, whatever page went wrong.
        who = authenticator_of(request).identify(request)
        frame = self.frame(request, "error", who)
        page = ErrorPage(frame, problem.status, f"error.{known}")
        response = self.draw(page, problem.status)
        response.headers.update(problem.headers)
        return response

    def refused_link(self, request: Request, problem: Problem) -> Response:
        """The page for a sign-in link that is wrong, or tried too often."""
        if problem.status != 401:
            return self.problem(request, problem)
        return self.sign_in(request, 401, wrong=True)

    def sign_in(
        self,
        request: Request,
        status: int = 200,
        *,
        wrong: bool = False,
        failure: str = "",
    ) -> Response:
        """The sign-in page; ``failure`` is the identity provider's."""
        address, frame = (
            str(request.base_url).rstrip("/"),
            self.frame(request, "signin"),
        )
        page = SignInPage(frame, address, wrong, LEAST, failure)
        return self.draw(page, status)


def router(
    pages: Pages,
    *,
    document: Callable[[], ApiDoc],
    rule: Callable[[], DetectionRule],
    sign_on: SingleSignOn | None = None,
) -> APIRouter:
    """The routes of all pages.

    Args:
        pages: What draws them.
        document: The HTTP interface as it stands.
        rule: The version in force.
        sign_on: Signs people out at the identity provider, too; None: there is none.
    """
    routes = APIRouter(include_in_schema=False, default_response_class=HTMLResponse)
    for route, path in _SCRIPTED.items():
        add_scripted(routes, pages, route, path)
    add_scripted(routes, pages, "what_if", "/what-if")
    add_scripted(routes, pages, "audit", "/audit", "release")
    for route in ("users", "tokens", "sessions"):
        add_scripted(routes, pages, route, f"/{route}", "admin")

    @routes.get("/account", response_model=None)
    async def account(request: Request, visitor: _Reader) -> Response:
        return pages.draw(AccountPage(pages.frame(request, "account", visitor), LEAST))

    @routes.get("/decisions/{decision_id}", response_model=None)
    async def decision(
        request: Request,
        visitor: _Reader,
        decision_id: _RECORD_ID,
    ) -> Response:
        frame = pages.frame(request, "decision", visitor)
        return pages.draw(RecordPage(frame, decision_id))

    @routes.get("/commands/{command_id}", response_model=None)
    async def command(
        request: Request,
        visitor: _Reader,
        command_id: _RECORD_ID,
    ) -> Response:
        frame = pages.frame(request, "command", visitor)
        return pages.draw(RecordPage(frame, command_id))

    @routes.get("/docs", response_model=None)
    async def docs(request: Request, visitor: _Reader) -> Response:
        # Made once, in a thread: it takes most of a second.
        found = await asyncio.to_thread(document)
        return pages.draw(DocsPage(pages.frame(request, "docs", visitor), found))

    @routes.get("/about", response_model=None)
    async def about(request: Request, visitor: _Reader) -> Response:
        return pages.draw(AboutPage(pages.frame(request, "about", visitor), rule()))

    _add_signing(routes, pages, sign_on)
    return routes


def _add_signing(routes: APIRouter, pages: Pages, sign_on: SingleSignOn | None) -> None:
    @routes.get("/signin", response_model=None, dependencies=[Depends(require("open"))])
    async def signin(request: Request) -> Response:
        return pages.sign_in(request)

    @routes.post(
        "/signin", response_model=None, dependencies=[Depends(require("open"))]
    )
    async def sign_in(request: Request, body: _SignIn) -> Response:
        found = await _enter(request, body)
        return found.response() if isinstance(found, Problem) else found

    # Whose session is past its age can end it, too.
    @routes.post(
        "/signout", response_model=None, dependencies=[Depends(require("stop"))]
    )
    async def sign_out(request: Request) -> Response:
        return await _leave(request, sign_on)

    @routes.post("/wall", status_code=204)
    async def wall(request: Request, visitor: _Reader) -> None:
        # A screen on a wall is everybody's: it looks and stops, and frees nothing.
        authenticator_of(request).sessions.lower(visitor)


def add_scripted(
    routes: APIRouter, pages: Pages, route: str, path: str, needs: Action = "read"
) -> None:
    """Add a page that its script fills; ``route`` names template and script."""

    @routes.get(path, name=route, response_model=None)
    async def scripted(
        request: Request, visitor: Annotated[Principal, Depends(require(needs))]
    ) -> Response:
        return pages.draw(Page(pages.frame(request, route, visitor)))


async def _enter(request: Request, body: _SignIn) -> Response | Problem:
    authenticator = authenticator_of(request)
    match body:
        case _ByLink():
            return authenticator.sign_in(request, body.token)
        case _ByPassword(name=name, password=password):
            return await authenticator.sign_in_by_password(request, name, password)
        case _ByInvitation(invitation=invitation, password=password):
            return await authenticator.accept(request, invitation, password)
        case _ByPasskey(passkey=answer):
            return await authenticator.sign_in_by_passkey(request, answer)


async def _leave(request: Request, sign_on: SingleSignOn | None) -> Response:
    """End a session, here before anywhere else."""
    authenticator = authenticator_of(request)
    who = authenticator.identify(request)
    gone = authenticator.sign_out(request)
    if sign_on is None or who is None:
        return gone
    onward = await sign_on.sign_out_address(request, who)
    if onward is None:
        return gone
    cookie = gone.headers["set-cookie"]
    return JSONResponse({"next": onward}, headers={"Set-Cookie": cookie})


def _look(request: Request) -> Appearance:
    chosen = request.cookies
    language = chosen.get(cookies.LANGUAGE, "")
    if language not in LANGUAGES:
        language = preferred_language(request.headers.get("accept-language", ""))
    theme = THEMES.get(chosen.get(cookies.THEME, ""), "auto")
    return Appearance(language, theme, chosen.get(cookies.PALETTE) == "paper")


def limits_text() -> str:
    """The table of safety numbers, as ``static/js/core/limits.js`` reads it."""
    return json.dumps(asdict(LIMITS))


def _clock(stamp: str) -> str:
    """Time of day in Madrid of an ISO-8601 stamp."""
    return f"{in_madrid(datetime.fromisoformat(stamp).timestamp()):%H:%M:%S}"


def _wall(stamp: str) -> str:
    """Day and time in Madrid of an ISO-8601 stamp, as a form has them."""
    at = datetime.fromisoformat(stamp).timestamp()
    return in_madrid(at).isoformat(" ", "seconds")


def _before(stamp: str) -> str:
    """Ten seconds before an ISO-8601 stamp, as an address of the map of then."""
    at = datetime.fromisoformat(stamp).timestamp()
    return f"/?t={format_stamp(at - 10.0)}"


def _environment(translations: Translations) -> Environment:
    """Templates that speak one language."""
    environment = Environment(
        loader=FileSystemLoader(str(files("iveg") / "templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

    environment.filters["clock"] = _clock
    environment.filters["wall"] = _wall
    environment.filters["before"] = _before
    environment.filters["lane"] = Sentences(translations).lane

    def say(key: str, **slots: Slot) -> Markup:
        data = Markup(' data-slots="{}"').format(json.dumps(slots)) if slots else ""
        return Markup('<span data-i18n="{}"{}>{}</span>').format(
            key, data, translations.say(key, **slots)
        )

    def label(attribute: str, key: str, **slots: Slot) -> Markup:
        data = Markup(' data-slots="{}"').format(json.dumps(slots)) if slots else ""
        return Markup('{}="{}" data-i18n-{}="{}"{}').format(
            attribute, translations.say(key, **slots), attribute, key, data
        )

    def greenhouse(name: str) -> str:
        return translations.sentences.get(f"greenhouse.{name}", name)

    def say_house(name: str) -> Markup:
        key = f"greenhouse.{name}"
        return say(key) if key in translations.sentences else escape(name)

    environment.globals.update(
        greenhouse=greenhouse,
        say_house=say_house,
        t=translations.say,
        say=say,
        label=label,
        has=translations.sentences.__contains__,
        limits=LIMITS,
        limits_text=limits_text(),
    )
    return environment
