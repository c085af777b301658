"""Admission of people and programs; each change names its author.

An invitation or a token is returned once.  Only its digest is stored.
"""

import secrets
from dataclasses import replace
from typing import Final

from iveg.adapters.clock import new_id
from iveg.domain.accounts import (
    AccessBook,
    AccessChange,
    Account,
    ApiToken,
    PersonRole,
    TokenScope,
    another_name,
    digest_of,
    is_name,
    is_reserved,
)
from iveg.domain.audit import Actor
from iveg.domain.errors import (
    NameTakenError,
    NotANameError,
    ProvidedAccountError,
    SignOnError,
)
from iveg.domain.retention import DAY_S

MOST_ACCOUNTS: Final = 1000
INVITED_S: Final = 3 * DAY_S
"""Life of an invitation (s)."""


class Admission:
    """Changes of accounts and tokens.

    Args:
        book: Holds accounts and tokens.
        by: Author of the changes.
        now: This moment (Unix s).
    """

    def __init__(self, book: AccessBook, by: Actor, now: float) -> None:
        self._book, self._by, self._now = book, by, now

    # --- people -------------------------------------------------------------------

    def add(
        self,
        name: str,
        role: PersonRole,
        ends_at: float | None = None,
        waits_s: float = INVITED_S,
    ) -> tuple[str, Account]:
        """Add an account; returns its invitation, too.

        Raises:
            NotANameError: the name is not allowed.
            NameTakenError: another account has the name.
        """
        _refuse_name(name)
        account = Account(new_id(), name, role, ends_at=ends_at)
        invitation, invited = self._invited(account, waits_s)
        return invitation, self._add(invited)

    def reset(
        self, account: Account, waits_s: float = INVITED_S
    ) -> tuple[str, Account]:
        """Remove a password and invite again; sessions end.

        An account of the identity provider is let in again without an invitation.
        """
        reopened = replace(account, disabled=False, since=self._now)
        if account.provider:
            return "", self._change(reopened, "account_reset")
        invitation, invited = self._invited(replace(reopened, password=""), waits_s)
        return invitation, self._change(invited, "account_reset")

    def give_role(self, account: Account, role: PersonRole) -> Account:
        """Change a role; sessions end.

        Raises:
            ProvidedAccountError: the identity provider gives the role.
        """
        if account.provider:
            raise ProvidedAccountError(account.name)
        changed = replace(account, role=role, since=self._now)
        return self._change(changed, "account_role")

    def disable(self, account: Account) -> Account:
        """Shut a person out; an open invitation no longer counts."""
        disabled = replace(account, disabled=True, invitation="")
        return self._change(disabled, "account_disabled")

    def give_password(self, account: Account, password: str) -> Account:
        """Replace the hash of a password; sessions that began before end."""
        changed = replace(account, password=password, since=self._now)
        return self._change(changed, "password_changed")

    def vouched(self, user: Account) -> Account:
        """Admit a person of the identity provider, under their name here.

        A changed role ends earlier sessions.

        Args:
            user: Account as the provider describes it.

        Raises:
            SignOnError: the person is shut out here, or there are too many accounts.
        """
        account = self._book.accounts.get(user.account_id)
        if account is None:
            return self._add_vouched(user)
        if not account.is_open(self._now):
            raise SignOnError("disabled", account.account_id)
        if account.role == user.role:
            return account
        changed = replace(account, role=user.role, since=self._now)
        return self._change(changed, "account_role")

    def _add_vouched(self, user: Account) -> Account:
        # The provider decides how many people sign in, so that the bound stands here.
        if len(self._book.accounts) >= MOST_ACCOUNTS:
            raise SignOnError("busy", f"{MOST_ACCOUNTS} accounts are there already")
        marked = replace(user, name=another_name(user.name, user.account_id))
        try:
            return self._add(marked if is_reserved(user.name) else user)
        except NameTakenError:
            return self._add(marked)

    def _add(self, account: Account) -> Account:
        return self._change(account, "account_added", ends_at=account.ends_at)

    def _change(self, account: Account, action: str, **details: object) -> Account:
        facts = {"role": account.role, **details}
        self._book.apply(AccessChange(action, account, facts, by=self._by))
        return account

    def _invited(self, account: Account, waits_s: float) -> tuple[str, Account]:
        invitation = secrets.token_urlsafe(32)
        digest, until = digest_of(invitation), self._now + waits_s
        return invitation, replace(account, invitation=digest, invited_until=until)

    # --- programs -----------------------------------------------------------------

    def give_token(
        self, name: str, scope: TokenScope, ends_at: float | None = None
    ) -> tuple[str, ApiToken]:
        """Make a token for a program; its text is returned only here.

        Raises:
            NotANameError: the name is not allowed.
            NameTakenError: another token has the name.
        """
        _refuse_name(name)
        token = secrets.token_urlsafe(32)
        made = ApiToken(
            new_id(), name, scope, digest_of(token), self._now, ends_at=ends_at
        )
        details = {"scope": scope, "ends_at": ends_at}
        self._book.apply(AccessChange("token_added", made, details, by=self._by))
        return token, made

    def revoke(self, token: ApiToken) -> None:
        """Delete a token."""
        self._book.apply(AccessChange("token_revoked", token, gone=True, by=self._by))


def _refuse_name(name: str) -> None:
    if not is_name(name) or is_reserved(name):
        raise NotANameError(name)
