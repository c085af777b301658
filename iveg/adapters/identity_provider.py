"""Attempts to sign in at an identity provider, without the library of ``oidc``."""

from dataclasses import dataclass, field
from secrets import token_urlsafe
from typing import Final

import orjson
from cryptography.fernet import Fernet, InvalidToken

HOP: Final = "sso"
WAITS_S: Final = 600
"""Life of an attempt (s)."""


@dataclass(frozen=True, slots=True)
class Client:
    """Registration of iVeg at a provider.

    Attributes:
        issuer: Address of the provider, in its own spelling.
        secret: Client secret; empty: a public client, which PKCE alone protects.
    """

    issuer: str
    client_id: str
    secret: str = field(repr=False)
    scopes: str


@dataclass(frozen=True, slots=True)
class Attempt:
    """Sign-in on its way through the provider.

    Attributes:
        back: Address to which the provider returns the browser (``redirect_uri``).
        to: Path of iVeg that opens after the sign-in.
        state, nonce, verifier: Bind answer, ID token and code to this attempt.
    """

    back: str
    to: str = "/"
    state: str = field(default_factory=token_urlsafe, repr=False)
    nonce: str = field(default_factory=token_urlsafe, repr=False)
    verifier: str = field(default_factory=token_urlsafe, repr=False)


class SealedAttempts:
    """Attempts for cookies, sealed by a key that ends with the process."""

    def __init__(self) -> None:
        self._seal = Fernet(Fernet.generate_key())

    def seal(self, attempt: Attempt, now: float) -> str:
        """Encrypt and sign an attempt as a text (``now`` in Unix s)."""
        return self._seal.encrypt_at_time(orjson.dumps(attempt), int(now)).decode()

    def open(self, sealed: str, now: float) -> Attempt | None:
        """The attempt in a text; None where it has expired or the seal is wrong."""
        try:
            opened = self._seal.decrypt_at_time(sealed.encode(), WAITS_S, int(now))
        except InvalidToken:
            return None
        return Attempt(**orjson.loads(opened))
