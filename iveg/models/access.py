"""Accounts of people, their links and sessions, and programs that may call."""

from typing import Literal, Self

from iveg.domain.accounts import (
    Account,
    AccountState,
    ApiToken,
    SignInMethod,
)
from iveg.domain.audit import Actor
from iveg.models.base import Model, Stamp, members_of

SessionKind = Literal["link", "account"]


class SignInCode(Model):
    """The link of an [Invitation](#invitation), and its QR code.

    Attributes:
        link: Begins the account, once.
        image: Its QR code as a data address.
    """

    link: str
    image: str


@members_of(Actor, "name", "role")
class OwnAccount(Model):
    """Account, link or token of the caller.

    Attributes:
        name: Name in log and audit.
        role: Role, which says what they may do.
        method: How they signed in.
        account: They have one; else a link or a token.
        signed_in_at: Null for programs.
        ends_at: When it ends by itself; null: never.
    """

    method: SignInMethod
    account: bool
    signed_in_at: Stamp | None
    ends_at: Stamp | None


class OpenSession(Model):
    """A browser in which somebody is signed in.

    Its id lets nobody in.

    Attributes:
        role: Role that is left now; ``expired``: STOP alone.
        kind: How they signed in.
        began_at: The sign-in.
        own: It is the caller's own session.
    """

    session_id: str
    name: str
    role: str
    kind: SessionKind
    began_at: Stamp
    own: bool


@members_of(Account, "name", "role")
class UserAccount(Model):
    """An account, as admins see it.

    Attributes:
        user_id: The id is never given anew.
        name: The id is never given anew.
        state: ``over``: it ended by itself.
        ends_at: When it ends by itself; null: never.
        invited_until: Null where no invitation waits.
        own: It is the caller's own, which only another admin may change.
        provided: The identity provider vouches for the person and gives the role.
    """

    user_id: str
    state: AccountState
    ends_at: Stamp | None
    invited_until: Stamp | None
    own: bool
    provided: bool

    @classmethod
    def from_account(cls, account: Account, now: float, *, own: bool = False) -> Self:
        """An account at this moment (Unix s)."""
        state = account.state(now)
        return cls.from_value(
            account,
            user_id=account.account_id,
            state=state,
            # An invitation that was used or has ended leaves its time in the account.
            invited_until=account.invited_until if state == "invited" else None,
            own=own,
            provided=bool(account.provider),
        )


class Invitation(Model):
    """An account with the link that begins it, which is shown this once.

    Attributes:
        user: The account.
        code: Null for a person of the identity provider.
    """

    user: UserAccount
    code: SignInCode | None


@members_of(ApiToken, "token_id", "name", "scope")
class ProgramToken(Model):
    """A program that may call, as admins see it.

    A program that may call, as admins see it; no answer but [NewToken](#newtoken) has
    its token.

    Attributes:
        token_id: The id is never given anew.
        name: The id is never given anew.
        scope: ``stop`` reads, too; ``operate`` does what an operator may.
        used_at: The last time; null: never.
        ends_at: When it ends by itself; null: never.
        over: It has ended by itself.
    """

    made_at: Stamp
    used_at: Stamp | None
    ends_at: Stamp | None
    over: bool

    @classmethod
    def from_token(cls, token: ApiToken, now: float) -> Self:
        """A program's token at this moment (Unix s)."""
        return cls.from_value(token, over=not token.is_open(now))


class NewToken(Model):
    """A program with its token, which is shown this once.

    Attributes:
        token: For ``Authorization: Bearer``; shown this once.
    """

    program: ProgramToken
    token: str
