"""Identity providers: what each has in common, and FIWARE Keyrock.

A provider that speaks OpenID Connect is ``adapters/oidc.py``.  Keyrock signs its ID
tokens with a secret that it shares (HS256), which proves nothing to us; there the
person is read from ``/user`` with the access token, straight from Keyrock.  Source:
the pages "OAuth" and "OIDC" of Keyrock's documentation (repository ging/fiware-idm).
"""

import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Protocol
from urllib.parse import urlencode

from iveg.adapters.bounded_json import BoundedJson
from iveg.domain.errors import SignOnError
from iveg.domain.records import Json

HOP: Final = "sso"


@dataclass(frozen=True, slots=True)
class Client:
    """iVeg as a provider knows it.

    Attributes:
        issuer: Address of the provider, as it spells it itself.
        secret: Empty: a public client, which PKCE alone protects.
    """

    issuer: str
    client_id: str
    secret: str = field(repr=False)
    scopes: str

    @property
    def login(self) -> tuple[str, str] | None:
        """Its user and password at the token endpoint."""
        return (self.client_id, self.secret) if self.secret else None


def _random() -> str:
    return secrets.token_urlsafe(32)


@dataclass(frozen=True, slots=True)
class Attempt:
    """One sign-in on its way through the provider.

    Attributes:
        back: Where the provider sends the browser (``redirect_uri``).
        state, nonce, verifier: Tie answer, ID token and code to it.
    """

    back: str
    state: str = field(default_factory=_random, repr=False)
    nonce: str = field(default_factory=_random, repr=False)
    verifier: str = field(default_factory=_random, repr=False)


@dataclass(frozen=True, slots=True)
class Vouched:
    """What a provider says of a person.

    Attributes:
        id_token: For the sign-out there; empty: none.
    """

    subject: str
    claims: Json
    id_token: str = field(default="", repr=False)


class IdentityProvider(Protocol):
    """Vouches for people. Each method raises HopError where it does not answer."""

    client: Client

    async def address(self, attempt: Attempt) -> str:
        """Where a browser goes to sign in."""

    async def vouch(self, attempt: Attempt, code: str) -> Vouched:
        """Exchange the code of an attempt. Raises SignOnError: it proves nothing."""

    async def sign_out_address(self, back: str, id_token: str, /) -> str | None:
        """Where a browser goes to sign out there, too; None: not offered."""

    async def close(self) -> None:
        """Close connections."""


class Keyrock:
    """FIWARE Keyrock, by OAuth 2.0 and its own ``/user``."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self._http = BoundedJson(HOP)

    async def address(self, attempt: Attempt) -> str:
        """Where a browser goes to sign in."""
        query = code_query(self.client, attempt)
        return f"{self.client.issuer}/oauth2/authorize?{urlencode(query)}"

    async def vouch(self, attempt: Attempt, code: str) -> Vouched:
        """Exchange the code, and read whose it is."""
        url = f"{self.client.issuer}/oauth2/token"
        token = await redeem(self._http, self.client, url, attempt, code)
        query = {"access_token": text_of(token, "access_token")}
        answer = await self._http.get(f"{self.client.issuer}/user", query)
        if not answer.is_success:
            raise SignOnError("untrusted", f"/user answered {answer.status}")
        # A token of another application would prove somebody to that one alone.
        if answer.body.get("app_id") != self.client.client_id:
            raise SignOnError("untrusted", "the token is another application's")
        return Vouched(text_of(answer.body, "id"), answer.body)

    async def sign_out_address(self, _back: str, _id_token: str) -> str | None:
        """Keyrock has no sign-out that leads back to an address it checks."""
        return None

    async def close(self) -> None:
        """Close connections."""
        await self._http.close()


def code_query(client: Client, attempt: Attempt) -> dict[str, str]:
    """Parameters of the code flow (RFC 6749, 4.1.1) that every provider gets."""
    return {
        "response_type": "code",
        "client_id": client.client_id,
        "redirect_uri": attempt.back,
        "state": attempt.state,
    }


async def redeem(
    http: BoundedJson, client: Client, url: str, attempt: Attempt, code: str
) -> Json:
    """Exchange a code at the token endpoint (RFC 6749, 4.1.3; RFC 7636, 4.5).

    Raises:
        HopError: no answer, or none that means anything.
        SignOnError: the code was refused.
    """
    form = {
        "grant_type": "authorization_code",
        "code": code,
        "redirect_uri": attempt.back,
        "code_verifier": attempt.verifier,
    }
    if not client.secret:
        form["client_id"] = client.client_id
    answer = await http.post(url, form, client.login)
    if not answer.is_success:
        raise SignOnError("untrusted", f"the code was refused: {answer.refusal}")
    return answer.body


def text_of(answer: Mapping[str, object], name: str) -> str:
    """A text that an answer must hold. Raises SignOnError."""
    value = answer.get(name)
    if not isinstance(value, str) or not value:
        raise SignOnError("untrusted", f"no {name} was told")
    return value
