"""The bearer that a PEP proxy before Orion and the agent asks for.

One token for both, got at a token endpoint (OAuth 2.0; FIWARE Keyrock's
``/oauth2/token``) before the first request::

    none ──ask──> held ──at 80 % of its life: asked for beside──> held anew
      ^             └──refused (401), or over──> asked for, and waited for
      └── not given: requests fail with that cause, and never leave without a bearer

Asked for by one request at a time, whoever waits; after a failure not before a pause.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal, Protocol

from iveg.domain.errors import HopError
from iveg.domain.records import Json

HOP: Final = "token"
PART_OF_LIFE: Final = 0.8
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 3.0
"""As between questions to Orion."""
_REFUSED_S: Final = 5.0
_UNTOLD_S, _MOST_S, _MOST_CHARACTERS = 300.0, 86400.0, 16 * 1024
"""A life that is not told (s), and the longest that is believed (s)."""
_log = logging.getLogger(__name__)

TokenHeader = Literal["Authorization", "X-Auth-Token"]


class TokenAnswer(Protocol):
    """What an endpoint says."""

    @property
    def body(self) -> Json:
        """Its object; empty where there is none."""

    @property
    def is_success(self) -> bool:
        """Whether it is one."""

    @property
    def refusal(self) -> str:
        """Status and error code of one that is none."""


class TokenHttp(Protocol):
    """Asks an endpoint, bounded in time and size."""

    async def post(
        self, url: str, form: Mapping[str, str], login: tuple[str, str] | None = None
    ) -> TokenAnswer:
        """POST a form. Raises HopError."""

    async def close(self) -> None:
        """Close the connection."""


@dataclass(frozen=True, slots=True)
class TokenGrant:
    """How a token is asked for.

    Attributes:
        url: Of the token endpoint.
        client_id: Name of iVeg there, with its ``secret``.
        user: With ``password``: iVeg acts as this user (password grant); empty: as
            itself (client credentials).  A token of Keyrock's by client credentials has
            no roles, so a PEP proxy that looks at them wants a user.
        header: Which the proxy reads.
    """

    url: str
    client_id: str
    secret: str = field(repr=False)
    user: str = ""
    password: str = field(default="", repr=False)
    scope: str = ""
    header: TokenHeader = "Authorization"

    @property
    def form(self) -> dict[str, str]:
        """What is posted (RFC 6749, 4.3.2 and 4.4.2)."""
        asked = {"grant_type": "client_credentials"}
        if self.user:
            asked = {
                "grant_type": "password",
                "username": self.user,
                "password": self.password,
            }
        return asked | ({"scope": self.scope} if self.scope else {})


@dataclass(frozen=True, slots=True)
class HeldToken:
    """A token.

    Attributes:
        renew_at: When another is asked for beside (s, monotonic).
        ends_at: When it is over (s, monotonic).
    """

    text: str = field(repr=False)
    renew_at: float
    ends_at: float


class FiwareToken:
    """Gets the token and keeps it new.

    Args:
        grant: How it is asked for.
        mono: The monotonic clock (s).
        http: Asks the endpoint.
    """

    def __init__(
        self, grant: TokenGrant, mono: Callable[[], float], http: TokenHttp
    ) -> None:
        self._grant, self._mono, self._http = grant, mono, http
        self._held: HeldToken | None = None
        self._asking: asyncio.Task[HeldToken] | None = None
        self._error: HopError | None = None
        self._pause_s, self._again_at = FIRST_PAUSE_S, float("-inf")
        self._refused_at = float("-inf")

    async def current(self) -> str:
        """A token that is not over. Raises HopError: there is none."""
        held, now = self._held, self._mono()
        if held is None or now >= held.ends_at:
            return await self._asked()
        if now >= held.renew_at and now >= self._again_at:
            # Beside: while the old one lasts, nobody waits for the new one.
            self._ask()
        return held.text

    async def after(self, refused: str) -> str | None:
        """Another token than the one that a proxy has refused. Raises HopError.

        None where the refused one is itself such another: Wilma says 401 also to whom
        it knows and gives no role, and asking on would help nobody.
        """
        if self._held is not None and self._held.text == refused:
            now = self._mono()
            if now - self._refused_at < _REFUSED_S:
                return None
            self._held, self._refused_at = None, now
        return await self.current()

    def header(self, token: str) -> Mapping[str, str]:
        """The header that carries a token."""
        if self._grant.header == "Authorization":
            return {"Authorization": f"Bearer {token}"}
        return {self._grant.header: token}

    async def close(self) -> None:
        """Close the connection to the endpoint."""
        if self._asking is not None:
            self._asking.cancel()
            await asyncio.gather(self._asking, return_exceptions=True)
        await self._http.close()

    async def _asked(self) -> str:
        if self._asking is None and self._error and self._mono() < self._again_at:
            raise HopError(HOP, self._error.detail)
        # Who gives up takes the answer from nobody else.
        return (await asyncio.shield(self._ask())).text

    def _ask(self) -> asyncio.Task[HeldToken]:
        if self._asking is None:
            self._asking = asyncio.create_task(self._fetch(), name="fiware-token")
            self._asking.add_done_callback(self._settle)
        return self._asking

    def _settle(self, task: asyncio.Task[HeldToken]) -> None:
        self._asking = None
        if task.cancelled():
            return
        error = task.exception()
        if error is None:
            self._held, self._error = task.result(), None
            self._pause_s, self._again_at = FIRST_PAUSE_S, float("-inf")
            return
        if self._error is None:
            _log.warning("no bearer for Orion and the agent: %s", error)
        failure = error if isinstance(error, HopError) else HopError(HOP, repr(error))
        self._error, self._again_at = failure, self._mono() + self._pause_s
        self._pause_s = min(LONGEST_PAUSE_S, 2 * self._pause_s)

    async def _fetch(self) -> HeldToken:
        grant, began = self._grant, self._mono()
        answer = await self._http.post(
            grant.url, grant.form, (grant.client_id, grant.secret)
        )
        if not answer.is_success:
            raise HopError(HOP, answer.refusal)
        text = answer.body.get("access_token")
        if not isinstance(text, str) or not _is_token(text):
            raise HopError(HOP, "answered no token")
        life_s = _life_of(answer)
        return HeldToken(text, began + PART_OF_LIFE * life_s, began + life_s)


def _is_token(text: str) -> bool:
    """Whether a text may stand in a header."""
    return (
        0 < len(text) <= _MOST_CHARACTERS
        and text.isascii()
        and text.isprintable()
        and " " not in text
    )


def _life_of(answer: TokenAnswer) -> float:
    life = answer.body.get("expires_in")
    if isinstance(life, str) and life.isdecimal():
        life = int(life[:9])
    if not isinstance(life, int | float) or isinstance(life, bool) or not life > 0:
        return _UNTOLD_S
    return min(float(life), _MOST_S)
