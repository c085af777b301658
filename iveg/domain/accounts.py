"""People who sign in: how they may be called, and how they came in.

A name travels with each STOP through Orion, which refuses some characters with the
whole update they stand in; such a name would stop nothing by that transport.
"""

import hashlib
import unicodedata
from dataclasses import dataclass
from typing import Final, Literal

SignInMethod = Literal["link", "password", "passkey", "pin", "sso", "tablet", "token"]
"""Proof of an identity: ``sso`` is the identity provider's, ``token`` a program's,
``tablet`` a shared browser's."""
OF_ACCOUNTS: Final = frozenset({"password", "passkey", "sso"})
"""Methods of people with an account, which decides over their sessions."""
PersonRole = Literal["viewer", "operator", "admin"]
Language = Literal["es", "en"]
AccountState = Literal["active", "invited", "lapsed", "over", "disabled"]
"""``lapsed``: the invitation was not taken in time; ``over``: ended by itself."""
TokenScope = Literal["read", "stop", "operate"]
"""What a program may: read; also stop; also release, resume and all else of people."""

LINK_PERSON: Final = "link"
"""Id of whoever holds the link of the environment."""
DEFAULT_NAME: Final = "operator"
"""The name of that person where the settings give none."""
MOST_NAME: Final = 64
_REFUSED: Final = frozenset("<>\"'=;()")


def is_name(text: str) -> bool:
    """Whether a person may be called so: short, visible, and taken by Orion."""
    return (
        0 < len(text) <= MOST_NAME
        and text == unicodedata.normalize("NFC", text).strip()
        and _REFUSED.isdisjoint(text)
        and not any(unicodedata.category(one)[0] == "C" for one in text)
    )


def name_key(name: str) -> str:
    """What two names may not share: case and width do not tell people apart."""
    return unicodedata.normalize("NFKC", name).casefold().strip()


def digest_of(secret: str) -> str:
    """What is kept of an invitation or a token: SHA-256 (hex)."""
    return hashlib.sha256(secret.encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Account:
    """A person who may sign in.

    Attributes:
        account_id: Never given anew, as names may be.
        password: Its hash (PHC string format); empty until the invitation is accepted.
        ends_at: When it closes by itself (Unix s); None: never.
        invitation: SHA-256 of what is waited for (hex); empty: nothing.
        invited_until: When the invitation is over (Unix s).
        since: Sessions that began before are over (Unix s): a new role or password.
        provider: Issuer that vouches for the person and gives the role; empty: none.
        language: What the person reads; empty: whatever their browser asks for.
        pin: Hash of what unlocks a shared tablet; empty: nothing does.
    """

    account_id: str
    name: str
    role: PersonRole
    password: str = ""
    disabled: bool = False
    ends_at: float | None = None
    invitation: str = ""
    invited_until: float = 0.0
    since: float = 0.0
    provider: str = ""
    language: Language | Literal[""] = ""
    pin: str = ""

    def is_open(self, now: float) -> bool:
        """Whether the person may be here at this moment (Unix s)."""
        return not self.disabled and (self.ends_at is None or now < self.ends_at)

    def state(self, now: float) -> AccountState:
        """What became of the account at this moment (Unix s)."""
        if self.disabled:
            return "disabled"
        if not self.is_open(now):
            return "over"
        if self.password or self.provider:
            return "active"
        return "invited" if self.invitation and now < self.invited_until else "lapsed"


@dataclass(frozen=True, slots=True)
class ApiToken:
    """A program that may call, by a token of which the digest is kept.

    Attributes:
        digest: SHA-256 of the token (hex).
        made_at: When (Unix s); ``used_at`` when it was used last, to a minute.
        ends_at: When it ends by itself (Unix s); None: never.
    """

    token_id: str
    name: str
    scope: TokenScope
    digest: str
    made_at: float
    used_at: float | None = None
    ends_at: float | None = None

    def is_open(self, now: float) -> bool:
        """Whether it lets the program in at this moment (Unix s)."""
        return self.ends_at is None or now < self.ends_at
