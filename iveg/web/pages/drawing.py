"""Drawing of pages: a context by its template, in the reader's language."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime
from importlib.resources import files

from fastapi import Request, Response
from fastapi.responses import HTMLResponse
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from iveg.adapters.passwords import LEAST
from iveg.domain.limits import LIMITS
from iveg.domain.parameters import CLASSES, PARAMETERS
from iveg.web import cookies
from iveg.web.pages.contexts import THEMES, Appearance, PageFrame, Site
from iveg.web.pages.sentences import (
    LANGUAGES,
    Sentences,
    in_madrid,
    preferred_language,
    read_sentences,
)
from iveg.web.problems import Problem
from iveg.web.security.requirements import authenticator_of
from iveg.web.security.roles import Principal


def limits_text() -> str:
    """The table of safety numbers, as ``static/js/core/limits.js`` reads it."""
    return json.dumps(asdict(LIMITS))


def rule_parameters_text() -> str:
    """The parameters of the rule, as ``static/js/pages/parameters.js`` reads them."""
    keys = ("key", "class_key", "unit", "protects", "word")
    return json.dumps([{key: getattr(row, key) for key in keys} for row in PARAMETERS])


def _time_of_day(stamp: str) -> str:
    """An ISO-8601 stamp as the time in Madrid."""
    return f"{in_madrid(datetime.fromisoformat(stamp).timestamp()):%H:%M:%S}"


def environment_of(texts: Sentences) -> Environment:
    """Templates that speak one language."""

    def tell(key: str, **slots: object) -> str:
        return texts.say(key, slots)

    # The page itself fills the sentence anew when its language is switched.
    def slots_of(slots: Mapping[str, object]) -> Markup:
        if not slots:
            return Markup()
        return Markup(' data-slots="{}"').format(json.dumps(slots))

    def say(key: str, **slots: object) -> Markup:
        return Markup('<span data-i18n="{}"{}>{}</span>').format(
            key, slots_of(slots), texts.say(key, slots)
        )

    def label(attribute: str, key: str, **slots: object) -> Markup:
        return Markup('{}="{}" data-i18n-{}="{}"{}').format(
            attribute, texts.say(key, slots), attribute, key, slots_of(slots)
        )

    def greenhouse(name: str) -> str:
        return texts.sentences.get(f"greenhouse.{name}", name)

    def say_house(name: str) -> Markup:
        key = f"greenhouse.{name}"
        return say(key) if key in texts.sentences else escape(name)

    environment = Environment(
        loader=FileSystemLoader(str(files("iveg") / "templates")),
        autoescape=True,
        # A misspelt name fails in the tests, not as a gap on the page.
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(clock=_time_of_day, lane=texts.lane)
    environment.globals.update(
        greenhouse=greenhouse,
        say_house=say_house,
        t=tell,
        say=say,
        label=label,
        limits_text=limits_text(),
        rule_parameters=PARAMETERS,
        rule_parameters_text=rule_parameters_text(),
        classes=CLASSES,
    )
    return environment


_EXPLAINED = (400, 401, 403, 404, 405, 429, 500, 503)


class Pages:
    """Draws pages; one for the life of the server.

    Args:
        site: Facts that all pages of this server share.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self._environments = {
            language: environment_of(read_sentences(language)) for language in LANGUAGES
        }

    def frame(
        self, request: Request, route: str, visitor: Principal | None = None
    ) -> PageFrame:
        """The frame around a page for this reader."""
        return PageFrame(
            self._site,
            appearance_of(request),
            route,
            visitor.name if visitor else None,
            visitor.role if visitor else None,
            account=visitor is not None and visitor.has_account,
        )

    def draw(self, frame: PageFrame, code: int = 200, **added: object) -> HTMLResponse:
        """A page as a response.

        Args:
            frame: Surrounds it; its route names the template.
            code: HTTP status.
            added: Further members of ``page`` in the template.
        """
        template = self._environments[frame.look.language].get_template(
            f"{frame.route}.html"
        )
        html = template.render(page={"frame": frame, **added})
        # One address has several languages and looks: no cache may mix them up.
        return HTMLResponse(html, code, {"Vary": "Cookie, Accept-Language"})

    def problem(self, request: Request, problem: Problem) -> Response:
        """A problem as a page: sign-in for a stranger, an explanation for others."""
        if problem.status == 401:
            return self.sign_in(request, 401)
        known = problem.status if problem.status in _EXPLAINED else "other"
        # A person who is signed in keeps the STOP controls on every failed page.
        principal = authenticator_of(request).identify(request)
        frame = self.frame(request, "error", principal)
        code, sentence = problem.status, f"error.{known}"
        response = self.draw(frame, code, status=code, sentence=sentence)
        response.headers.update(problem.headers)
        return response

    def sign_in(
        self, request: Request, status: int = 200, *, failure: str = ""
    ) -> Response:
        """The sign-in page; ``failure`` is the identity provider's."""
        address = str(request.base_url).rstrip("/")
        frame = self.frame(request, "signin")
        return self.draw(frame, status, address=address, least=LEAST, failure=failure)


def appearance_of(request: Request) -> Appearance:
    """Language and colours that a reader chose, else those of the browser."""
    chosen = request.cookies
    language = chosen.get(cookies.LANGUAGE, "")
    if language not in LANGUAGES:
        language = preferred_language(request.headers.get("accept-language", ""))
    theme = THEMES.get(chosen.get(cookies.THEME, ""), "auto")
    return Appearance(language, theme, chosen.get(cookies.PALETTE) == "paper")
