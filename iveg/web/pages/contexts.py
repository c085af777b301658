"""The frame around every page.

A template sees ``page.frame``, what its route adds to ``page``, and the functions ``t``
(a sentence), ``say`` (a sentence that follows the language switch) and ``label`` (the
same, as an attribute).  Live values never come this way; they arrive on ``/live``.
"""

from dataclasses import dataclass
from typing import Literal, get_args

from iveg.domain.transports import TRANSPORTS

Theme = Literal["auto", "light", "dark", "sunlight"]
HUES = 10
"""Number of hues; more robots than that share them."""
THEMES: dict[str, Theme] = {theme: theme for theme in get_args(Theme)}


@dataclass(frozen=True, slots=True)
class Site:
    """Facts about this server that every page shows.

    Attributes:
        greenhouse: Its name.
        robots: Ids in fleet order; the order decides each robot's colour.
        demo: The robots are emulated.
        transports: Ids, in the order of their columns.
        link: One link signs people in; else passwords alone do.
        sso: Label of the identity provider's button; None: there is no provider.
    """

    greenhouse: str
    robots: tuple[str, ...]
    version: str
    demo: bool
    transports: tuple[str, ...] = tuple(transport.id for transport in TRANSPORTS)
    link: bool = True
    sso: str | None = None

    @property
    def slots(self) -> dict[str, int]:
        """Robot → number of its hue in ``css/tokens.css``, from 1."""
        return {robot: n % HUES + 1 for n, robot in enumerate(self.robots)}


@dataclass(frozen=True, slots=True)
class Appearance:
    """Appearance that a reader chose, kept in the browser's cookies."""

    language: str = "es"
    theme: Theme = "auto"
    paper_colours: bool = False


@dataclass(frozen=True, slots=True)
class PageFrame:
    """Context of ``base.html``, which surrounds every page.

    Attributes:
        route: Name of the page: of its template, and of its entry in the navigation.
        name: Name of the reader; None shows neither navigation nor STOP.
        role: ``viewer``, ``operator``, ``admin`` or ``program``.
        account: Whether the reader has an account.
    """

    site: Site
    look: Appearance
    route: str
    name: str | None = None
    role: str | None = None
    account: bool = False
