"""Accounts, the links that people sign in with, and open sessions."""

from typing import Literal

from pydantic import Field

from iveg.domain.accounts import (
    Account,
    AccountState,
    PersonRole,
    SignInMethod,
)
from iveg.models.base import Model, stamp

SessionKind = Literal["link", "account", "wall"]


class SignInCode(Model):
    """The sign-in link, and its QR code as a data address of an image."""

    link: str
    image: str
    local: bool = Field(
        description="The address works on the server's own computer alone."
    )


class OwnAccount(Model):
    """Whoever asks, as they are known here."""

    name: str
    role: str
    method: SignInMethod = Field(description="How they came in.")
    account: bool = Field(description="They have one; else a link or a token.")
    signed_in_at: str | None = Field(description="Null for programs.")
    ends_at: str | None = Field(description="When it ends by itself; null: never.")


class OpenSession(Model):
    """A browser in which somebody is signed in."""

    session_id: str
    name: str
    role: str = Field(description="That is left now; `expired`: STOP alone.")
    kind: SessionKind = Field(description="`wall`: of a screen, it looks and stops.")
    began_at: str
    seen_at: str = Field(description="The last request.")
    own: bool = Field(description="The one that asks.")


class SessionsEnded(Model):
    """How many sessions have ended."""

    ended: int


class UserAccount(Model):
    """An account, as admins see it."""

    user_id: str
    name: str
    role: PersonRole
    state: AccountState
    ends_at: str | None = Field(description="When it ends by itself; null: never.")
    invited_until: str | None = Field(description="Null where no invitation waits.")
    own: bool = Field(description="Of whoever asks: another admin changes it.")
    provided: bool = Field(
        description="The identity provider vouches for the person and gives the role."
    )

    @classmethod
    def of(cls, account: Account, now: float, *, own: bool = False) -> "UserAccount":
        """As it is at this moment (Unix s)."""
        state = account.state(now)
        return cls(
            user_id=account.account_id,
            name=account.name,
            role=account.role,
            state=state,
            ends_at=stamp(account.ends_at),
            invited_until=stamp(account.invited_until if state == "invited" else None),
            own=own,
            provided=bool(account.provider),
        )


class Invitation(Model):
    """An account with the link that begins it, which is shown this once."""

    user: UserAccount
    code: SignInCode | None = Field(
        description="Null for somebody whom the identity provider vouches for."
    )
