"""Contexts of the templates: one frozen dataclass for each template.

A template sees its own dataclass as ``page`` and the functions ``t`` (a sentence),
``say`` (a sentence that follows the language switch) and ``label`` (the same, as an
attribute).  Live values never come this way; they arrive on ``/live``.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.transports import TRANSPORTS
from iveg.models.day import Day
from iveg.web.pages.openapi import ApiDoc

Theme = Literal["auto", "light", "dark", "sunlight"]
THEMES: tuple[Theme, ...] = ("auto", "light", "dark", "sunlight")


@dataclass(frozen=True, slots=True)
class Site:
    """Facts about this server that every page shows.

    Attributes:
        greenhouse: Name as people say it.
        robots: Ids in fleet order; the order decides each robot's colour.
        demo: The robots are emulated.
        transports: Ids, in the order of their columns.
    """

    greenhouse: str
    robots: tuple[str, ...]
    version: str
    demo: bool
    transports: tuple[str, ...] = tuple(one.id for one in TRANSPORTS)


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
        route: Which entry of the navigation is current.
        name: Who is signed in; None shows neither navigation nor STOP.
        role: ``viewer``, ``operator``, ``admin`` or ``program``.
    """

    site: Site
    look: Appearance
    route: str
    name: str | None = None
    role: str | None = None


@dataclass(frozen=True, slots=True)
class LivePage:
    """``live.html``: the five widgets, empty until ``/live`` speaks."""

    template: ClassVar[str] = "live.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class HistoryPage:
    """``history.html``: the shell that the history scripts fill."""

    template: ClassVar[str] = "history.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class AlertsPage:
    """``alerts.html``: what is active, the sound, and what was."""

    template: ClassVar[str] = "alerts.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class CommandsPage:
    """``commands.html``: every STOP, release and resume with its times."""

    template: ClassVar[str] = "commands.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class FleetPage:
    """``fleet.html``: the data path from robot to screen, the robots, their devices."""

    template: ClassVar[str] = "fleet.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class ClimatePage:
    """``climate.html``: the air in the greenhouse."""

    template: ClassVar[str] = "climate.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class LatencyPage:
    """``latency.html``: latency, hop by hop."""

    template: ClassVar[str] = "latency.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class ExperimentsPage:
    """``experiments.html``: the paper's evaluation, started and watched."""

    template: ClassVar[str] = "experiments.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class SettingsPage:
    """``settings.html``: the rule in force, and what this device remembers."""

    template: ClassVar[str] = "settings.html"
    frame: PageFrame


@dataclass(frozen=True, slots=True)
class DecisionPage:
    """``decision.html``: one decision by its own address, to share and to print.

    Attributes:
        decision_id: As asked for; whether it exists is said by the API.
    """

    template: ClassVar[str] = "decision.html"
    frame: PageFrame
    decision_id: str


@dataclass(frozen=True, slots=True)
class DayPage:
    """``day.html``: one day of the fleet on one sheet.

    Attributes:
        day: What was, read from the history.
        before: The day before, ``after`` the one after it, as ISO dates.
    """

    template: ClassVar[str] = "day.html"
    frame: PageFrame
    day: Day
    before: str
    after: str


@dataclass(frozen=True, slots=True)
class DocsPage:
    """``docs.html``: the HTTP interface, drawn from our own OpenAPI document."""

    template: ClassVar[str] = "docs.html"
    frame: PageFrame
    document: ApiDoc


@dataclass(frozen=True, slots=True)
class AboutPage:
    """``about.html``: what iVeg is, and what STOP is not.

    Attributes:
        rule: In force now; the page follows it on ``/live``.
    """

    template: ClassVar[str] = "about.html"
    frame: PageFrame
    rule: DetectionRule


@dataclass(frozen=True, slots=True)
class SignInPage:
    """``signin.html``: how to get in.

    Attributes:
        address: Of this server, as the browser reached it.
        wrong: A link was tried and does not sign in.
    """

    template: ClassVar[str] = "signin.html"
    frame: PageFrame
    address: str
    wrong: bool = False


@dataclass(frozen=True, slots=True)
class ErrorPage:
    """``error.html``: an error, explained for a person.

    Attributes:
        status: HTTP status.
        sentence: Key of the sentence that explains it.
    """

    template: ClassVar[str] = "error.html"
    frame: PageFrame
    status: int
    sentence: str


Page = (
    LivePage
    | DayPage
    | HistoryPage
    | AlertsPage
    | CommandsPage
    | FleetPage
    | ClimatePage
    | LatencyPage
    | ExperimentsPage
    | SettingsPage
    | DecisionPage
    | DocsPage
    | AboutPage
    | SignInPage
    | ErrorPage
)
