"""HTML pages: each is one context drawn by its template, in the reader's language.

``Pages`` draws; ``router`` gives each page its address.  The dependencies that are
handed in decide who may read.
"""

import json
from collections.abc import Callable
from datetime import datetime
from importlib.resources import files
from typing import Annotated, Any, Protocol

from fastapi import APIRouter, Depends, Path
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from iveg.domain import limits
from iveg.domain.detection_rule import DetectionRule
from iveg.web.pages.contexts import (
    THEMES,
    AboutPage,
    AlertsPage,
    Appearance,
    ClimatePage,
    CommandsPage,
    DecisionPage,
    DocsPage,
    ErrorPage,
    FleetPage,
    HistoryPage,
    LatencyPage,
    LivePage,
    Page,
    PageFrame,
    SettingsPage,
    SignInPage,
    Site,
    Theme,
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

LANGUAGE_COOKIE = "iveg_language"
THEME_COOKIE = "iveg_theme"
PALETTE_COOKIE = "iveg_palette"

_DECISION_ID = r"^[ -~]{1,64}$"
_EXPLAINED = (400, 401, 403, 404, 405, 429, 500, 503)


class Visitor(Protocol):
    """The reader of a page; ``auth.Principal`` is one."""

    @property
    def name(self) -> str:
        """As shown to other people."""

    @property
    def role(self) -> str:
        """``viewer``, ``operator``, ``admin`` or ``program``."""


class Pages:
    """Draws pages; one for the life of the server.

    Args:
        site: What every page of this server has in common.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self._environments = {
            language: _environment(read_translations(language))
            for language in LANGUAGES
        }

    def frame(
        self, request: Request, route: str, visitor: Visitor | None = None
    ) -> PageFrame:
        """The frame around a page for this reader."""
        look = _look(request)
        if visitor is None:
            return PageFrame(self._site, look, route)
        return PageFrame(self._site, look, route, visitor.name, visitor.role)

    def draw(self, page: Page, status: int = 200) -> HTMLResponse:
        """A page as a response.

        Args:
            page: Its context.
            status: HTTP status.
        """
        environment = self._environments[page.frame.look.language]
        html = environment.get_template(page.template).render(page=page)
        return HTMLResponse(html, status, {"Vary": "Cookie, Accept-Language"})

    def problem(self, request: Request, problem: Problem) -> Response:
        """A problem as a page: sign-in for a stranger, an explanation for others."""
        if problem.status == 401:
            return self.sign_in(request, 401)
        known = problem.status if problem.status in _EXPLAINED else "other"
        # Somebody signed in keeps the STOP controls, whatever page went wrong.
        frame = self.frame(request, "error", _identified(request))
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
        self, request: Request, status: int = 200, *, wrong: bool = False
    ) -> Response:
        """The sign-in page."""
        address = str(request.base_url).rstrip("/")
        page = SignInPage(self.frame(request, "signin"), address, wrong)
        return self.draw(page, status)


def router(
    pages: Pages,
    *,
    reader: Callable[..., Any],
    anyone: Callable[..., Any],
    document: Callable[[], ApiDoc],
    rule: Callable[[], DetectionRule],
) -> APIRouter:
    """The routes of all pages.

    Args:
        pages: What draws them.
        reader: Dependency that gives the visitor, or refuses a stranger.
        anyone: Dependency of the page that is open to strangers.
        document: The HTTP interface as it stands.
        rule: The version in force.
    """
    routes = APIRouter(include_in_schema=False, default_response_class=HTMLResponse)
    who = Depends(reader)

    @routes.get("/", response_model=None)
    async def live(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(LivePage(pages.frame(request, "live", visitor)))

    @routes.get("/history", response_model=None)
    async def history(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(HistoryPage(pages.frame(request, "history", visitor)))

    _add_supervision(routes, pages, who)

    @routes.get("/docs", response_model=None)
    async def docs(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(DocsPage(pages.frame(request, "docs", visitor), document()))

    @routes.get("/about", response_model=None)
    async def about(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(AboutPage(pages.frame(request, "about", visitor), rule()))

    @routes.get("/signin", response_model=None, dependencies=[Depends(anyone)])
    async def signin(request: Request) -> Response:
        return pages.sign_in(request)

    @routes.post("/signout", response_model=None, dependencies=[who])
    async def sign_out(request: Request) -> Response:
        left: Response = request.app.state.authenticator.sign_out(request)
        return left

    return routes


def _add_supervision(routes: APIRouter, pages: Pages, who: Any) -> None:
    """The pages beside the map: what was, what is connected, what is in force."""

    @routes.get("/alerts", response_model=None)
    async def alerts(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(AlertsPage(pages.frame(request, "alerts", visitor)))

    @routes.get("/commands", response_model=None)
    async def commands(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(CommandsPage(pages.frame(request, "commands", visitor)))

    @routes.get("/fleet", response_model=None)
    async def fleet(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(FleetPage(pages.frame(request, "fleet", visitor)))

    @routes.get("/climate", response_model=None)
    async def climate(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(ClimatePage(pages.frame(request, "climate", visitor)))

    @routes.get("/latency", response_model=None)
    async def latency(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(LatencyPage(pages.frame(request, "latency", visitor)))

    @routes.get("/settings", response_model=None)
    async def settings(request: Request, visitor: Annotated[Any, who]) -> Response:
        return pages.draw(SettingsPage(pages.frame(request, "settings", visitor)))

    @routes.get("/decisions/{decision_id}", response_model=None)
    async def decision(
        request: Request,
        visitor: Annotated[Any, who],
        decision_id: Annotated[str, Path(pattern=_DECISION_ID)],
    ) -> Response:
        frame = pages.frame(request, "decision", visitor)
        return pages.draw(DecisionPage(frame, decision_id))


def _identified(request: Request) -> Visitor | None:
    authenticator = getattr(request.app.state, "authenticator", None)
    visitor: Visitor | None = (
        None if authenticator is None else authenticator.identify(request)
    )
    return visitor


def _look(request: Request) -> Appearance:
    cookies = request.cookies
    language = cookies.get(LANGUAGE_COOKIE, "")
    if language not in LANGUAGES:
        language = preferred_language(request.headers.get("accept-language", ""))
    theme = _theme(cookies.get(THEME_COOKIE))
    return Appearance(language, theme, cookies.get(PALETTE_COOKIE) == "paper")


def _theme(wanted: str | None) -> Theme:
    for theme in THEMES:
        if theme == wanted:
            return theme
    return "auto"


def limits_text() -> str:
    """The table of safety numbers, as ``static/js/core/limits.js`` reads it."""
    return json.dumps({row.name: row.value for row in limits.rows()})


def _clock(stamp: str) -> str:
    """Time of day in Madrid of an ISO-8601 stamp."""
    return f"{in_madrid(datetime.fromisoformat(stamp).timestamp()):%H:%M:%S}"


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
        known = translations.sentences.get(f"greenhouse.{name}")
        return name if known is None else known

    def say_house(name: str) -> Markup:
        key = f"greenhouse.{name}"
        return say(key) if key in translations.sentences else escape(name)

    environment.globals.update(
        greenhouse=greenhouse,
        say_house=say_house,
        t=translations.say,
        say=say,
        label=label,
        limits=limits.LIMITS,
        limits_text=limits_text(),
    )
    return environment
