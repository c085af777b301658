"""Draws pages: a context by its template, in the reader's language."""

from collections.abc import Callable
from dataclasses import replace

from fastapi import Request, Response
from fastapi.responses import HTMLResponse

from iveg.adapters.passwords import LEAST
from iveg.web import cookies
from iveg.web.pages.contexts import (
    THEMES,
    Appearance,
    ErrorPage,
    Page,
    PageFrame,
    SignInPage,
    Site,
)
from iveg.web.pages.templates import environment_of
from iveg.web.pages.translations import LANGUAGES, preferred_language, read_translations
from iveg.web.problem import Problem
from iveg.web.security.requirements import authenticator_of
from iveg.web.security.roles import Principal

_EXPLAINED = (400, 401, 403, 404, 405, 429, 500, 503)


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
            language: environment_of(read_translations(language))
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


def _look(request: Request) -> Appearance:
    chosen = request.cookies
    language = chosen.get(cookies.LANGUAGE, "")
    if language not in LANGUAGES:
        language = preferred_language(request.headers.get("accept-language", ""))
    theme = THEMES.get(chosen.get(cookies.THEME, ""), "auto")
    return Appearance(language, theme, chosen.get(cookies.PALETTE) == "paper")
