"""Sign-in at an identity provider, without the library that it takes.

``adapters/oidc.py`` is the one that speaks OpenID Connect (extra ``sso``).
"""

import secrets
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Final

import orjson
from cryptography.fernet import Fernet, InvalidToken

from iveg.adapters.bounded_json import BoundedJson
from iveg.domain.errors import SignOnError
from iveg.domain.records import Json

HOP: Final = "sso"
WAITS_S: Final = 600
"""Life of an attempt (s)."""


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


def _random() -> str:
    return secrets.token_urlsafe(32)


@dataclass(frozen=True, slots=True)
class Attempt:
    """One sign-in on its way through the provider.

    Attributes:
        back: Where the provider sends the browser (``redirect_uri``).
        to: Path of iVeg at which the person goes on.
        state, nonce, verifier: Tie answer, ID token and code to it.
    """

    back: str
    to: str = "/"
    state: str = field(default_factory=_random, repr=False)
    nonce: str = field(default_factory=_random, repr=False)
    verifier: str = field(default_factory=_random, repr=False)


class SealedAttempts:
    """Attempts as cookies keep them: sealed by a key that ends with the process."""

    def __init__(self) -> None:
        self._seal = Fernet(Fernet.generate_key())

    def seal(self, attempt: Attempt, now: float) -> str:
        """An attempt as a text that nobody else can read or make (``now`` Unix s)."""
        return self._seal.encrypt_at_time(orjson.dumps(attempt), int(now)).decode()

    def open(self, sealed: str, now: float) -> Attempt | None:
        """The attempt in a text; None where it is over, or no such text."""
        try:
            kept = self._seal.decrypt_at_time(sealed.encode(), WAITS_S, int(now))
        except InvalidToken:
            return None
        return Attempt(**orjson.loads(kept))


@dataclass(frozen=True, slots=True)
class Vouched:
    """Statement of a provider about a person."""

    subject: str
    claims: Json


class IdentityProvider(ABC):
    """Vouches for people; each method raises HopError where it does not answer."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self._http = BoundedJson(HOP)

    @abstractmethod
    async def address(self, attempt: Attempt) -> str:
        """Where a browser goes to sign in."""

    @abstractmethod
    async def vouch(self, attempt: Attempt, code: str) -> Vouched:
        """Exchange the code of an attempt. Raises SignOnError: it proves nothing."""

    async def close(self) -> None:
        """Close connections."""
        await self._http.close()


def text_of(answer: Json, name: str) -> str:
    """A text that an answer must hold. Raises SignOnError."""
    value = answer.get(name)
    if not isinstance(value, str) or not value:
        raise SignOnError("untrusted", f"no {name} was told")
    return value
