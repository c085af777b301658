"""Accounts of people, their links and sessions, and programs that may call."""

from typing import Literal, Self

from pydantic import Field

from iveg.domain.accounts import (
    Account,
    AccountState,
    ApiToken,
    PersonRole,
    SignInMethod,
    TokenScope,
)
from iveg.models.base import Model, Stamp

SessionKind = Literal["link", "account"]


class SignInCode(Model):
    """The link of an [Invitation](#invitation), and its QR code.

    Attributes:
        link: Begins the account, once.
        image: Its QR code as a data address.
    """

    link: str
    image: str


class OwnAccount(Model):
    """Whoever asks, as they are known here.

    Attributes:
        name: As in all that they do.
        role: As in all that they do.
    """

    name: str
    role: str
    method: SignInMethod = Field(description="How they came in.")
    account: bool = Field(description="They have one; else a link or a token.")
    signed_in_at: Stamp | None = Field(description="Null for programs.")
    ends_at: Stamp | None = Field(description="When it ends by itself; null: never.")


class OpenSession(Model):
    """A browser in which somebody is signed in.

    Its id lets nobody in.

    Attributes:
        kind: How they signed in.
        began_at: The sign-in.
    """

    session_id: str
    name: str
    role: str = Field(description="That is left now; `expired`: STOP alone.")
    kind: SessionKind
    began_at: Stamp
    own: bool = Field(description="The one that asks.")


class UserAccount(Model):
    """An account, as admins see it.

    Attributes:
        user_id: The id is never given anew.
        name: The id is never given anew.
        state: ``over``: it ended by itself.
    """

    user_id: str
    name: str
    role: PersonRole
    state: AccountState
    ends_at: Stamp | None = Field(description="When it ends by itself; null: never.")
    invited_until: Stamp | None = Field(description="Null where no invitation waits.")
    own: bool = Field(description="Of whoever asks: another admin changes it.")
    provided: bool = Field(
        description="The identity provider vouches for the person and gives the role."
    )

    @classmethod
    def of(cls, account: Account, now: float, *, own: bool = False) -> Self:
        """As it is at this moment (Unix s)."""
        state = account.state(now)
        return cls.from_value(
            account,
            user_id=account.account_id,
            state=state,
            invited_until=account.invited_until if state == "invited" else None,
            own=own,
            provided=bool(account.provider),
        )


class Invitation(Model):
    """An account with the link that begins it, which is shown this once.

    Attributes:
        user: The account.
    """

    user: UserAccount
    code: SignInCode | None = Field(
        description="Null for somebody whom the identity provider vouches for."
    )


class ProgramToken(Model):
    """A program that may call, as admins see it.

    A program that may call, as admins see it; no answer but [NewToken](#newtoken) has
    its token.

    Attributes:
        token_id: The id is never given anew.
        name: The id is never given anew.
        scope: ``stop`` reads, too; ``operate`` does what an operator may.
    """

    token_id: str
    name: str
    scope: TokenScope
    made_at: Stamp
    used_at: Stamp | None = Field(description="The last time; null: never.")
    ends_at: Stamp | None = Field(description="When it ends by itself; null: never.")
    over: bool = Field(description="It has ended by itself.")

    @classmethod
    def of(cls, token: ApiToken, now: float) -> Self:
        """As it is at this moment (Unix s)."""
        return cls.from_value(token, over=not token.is_open(now))


class NewToken(Model):
    """A program with its token, which is shown this once.

    Attributes:
        token: For ``Authorization: Bearer``; shown this once.
    """

    program: ProgramToken
    token: str
