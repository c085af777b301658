"""Contexts of the templates: one frozen dataclass for each kind of page.

A template sees its own dataclass as ``page`` and the functions ``t`` (a sentence),
``say`` (a sentence that follows the language switch) and ``label`` (the same, as an
attribute).  Live values never come this way; they arrive on ``/live``.
"""

from dataclasses import dataclass
from typing import Literal, get_args

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.transports import TRANSPORTS
from iveg.models.history import Day

Theme = Literal["auto", "light", "dark", "sunlight"]
HUES = 10
"""Robots that have a hue of their own."""
THEMES: dict[str, Theme] = {theme: theme for theme in get_args(Theme)}


@dataclass(frozen=True, slots=True)
class Site:
    """Facts about this server that every page shows.

    Attributes:
        greenhouse: Name as people say it.
        robots: Ids in fleet order; the order decides each robot's colour.
        demo: The robots are emulated.
        transports: Ids, in the order of their columns.
        link: One link signs people in; else passwords alone do.
        sso: What the button of the identity provider says; None: there is none.
    """

    greenhouse: str
    robots: tuple[str, ...]
    version: str
    demo: bool
    transports: tuple[str, ...] = tuple(one.id for one in TRANSPORTS)
    link: bool = True
    sso: str | None = None

    @property
    def slots(self) -> dict[str, int]:
        """Which of the hues in ``css/tokens.css`` is each robot's own, from 1."""
        return {robot: n % HUES + 1 for n, robot in enumerate(self.robots)}


@dataclass(frozen=True, slots=True)
class Appearance:
    """Appearance that this browser chose; remembered in its cookies."""

    language: str = "es"
    theme: Theme = "auto"
    paper_colours: bool = False


@dataclass(frozen=True, slots=True)
class PageFrame:
    """Context of ``base.html``, which surrounds every page.

    Attributes:
        route: Name of the page: of its template, and of its entry in the navigation.
        name: Who is signed in; None shows neither navigation nor STOP.
        role: ``viewer``, ``operator``, ``admin`` or ``program``.
        account: Whether they have one of their own.
        unready: Nobody can sign in as admin yet.
    """

    site: Site
    look: Appearance
    route: str
    name: str | None = None
    role: str | None = None
    account: bool = False
    unready: bool = False


@dataclass(frozen=True, slots=True)
class Page:
    """Context of a page; the whole of it where scripts fill the rest.

    Attributes:
        frame: Surrounds it; its route names the template.
    """

    frame: PageFrame


@dataclass(frozen=True, slots=True)
class RecordPage(Page):
    """``decision.html``, ``command.html``: a record to share and to print.

    Attributes:
        record_id: As asked for; whether it exists is said by the API.
    """

    record_id: str


@dataclass(frozen=True, slots=True)
class DayPage(Page):
    """``day.html``: one day of the fleet on one sheet.

    Attributes:
        day: What was, read from the history.
        before: The day before, ``after`` the one after it, as ISO dates.
    """

    day: Day
    before: str
    after: str


@dataclass(frozen=True, slots=True)
class AboutPage(Page):
    """``about.html``: what iVeg is, and what STOP is not.

    Attributes:
        rule: In force now; the page follows it on ``/live``.
    """

    rule: DetectionRule


@dataclass(frozen=True, slots=True)
class AccountPage(Page):
    """``account.html``: what somebody may know and change of themselves.

    Attributes:
        least: Characters of a password.
    """

    least: int


@dataclass(frozen=True, slots=True)
class SignInPage(Page):
    """``signin.html``: how to get in.

    Attributes:
        address: Of this server, as the browser reached it.
        least: Characters of a password.
        failure: Why the identity provider let nobody in; empty: it was not asked.
    """

    address: str
    least: int = 0
    failure: str = ""


@dataclass(frozen=True, slots=True)
class EnteredPage(Page):
    """``entered.html``: signed in by the identity provider.

    Attributes:
        to: Path at which the person goes on.
    """

    to: str


@dataclass(frozen=True, slots=True)
class ErrorPage(Page):
    """``error.html``: an error, explained for a person.

    Attributes:
        status: HTTP status.
        sentence: Key of the sentence that explains it.
    """

    status: int
    sentence: str
