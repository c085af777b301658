"""Admission of people and programs, each change by somebody.

What people and programs are given to come in with is returned once and stored nowhere:
of it only a digest is kept.
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
    """Changes who may come in.

    Args:
        book: Where that is known.
        by: Who changes it.
        now: This moment (Unix s).
    """

    def __init__(self, book: AccessBook, by: Actor, now: float) -> None:
        self._book = book
        self._by = by
        self._now = now

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
            NotANameError: nobody may be called so.
            NameTakenError: somebody is called so already.
        """
        _refuse_name(name)
        account = Account(new_id(), name, role, ends_at=ends_at)
        invitation, invited = self._invited(account, waits_s)
        return invitation, self._add(invited)

    def reset(
        self, account: Account, waits_s: float = INVITED_S
    ) -> tuple[str, Account]:
        """Take a password away and invite again; sessions end.

        Whom the provider vouches for is let in again, and gets no invitation.
        """
        back = replace(account, disabled=False, since=self._now)
        if account.provider:
            return "", self._change(back, "account_reset")
        invitation, invited = self._invited(replace(back, password=""), waits_s)
        return invitation, self._change(invited, "account_reset")

    def give_role(self, account: Account, role: PersonRole) -> Account:
        """Change a role; sessions end.

        Raises:
            ProvidedAccountError: the provider gives it.
        """
        if account.provider:
            raise ProvidedAccountError(account.name)
        changed = replace(account, role=role, since=self._now)
        return self._change(changed, "account_role")

    def disable(self, account: Account) -> Account:
        """Shut somebody out; an invitation that waits is none any more."""
        off = replace(account, disabled=True, invitation="")
        return self._change(off, "account_disabled")

    def give_password(self, account: Account, password: str) -> Account:
        """Put a hash in the place of another; sessions that began before are over."""
        changed = replace(account, password=password, since=self._now)
        return self._change(changed, "password_changed")

    def vouched(self, user: Account) -> Account:
        """Let somebody in whom a provider vouches for, under the name that they had.

        Another role ends the sessions of the one before.

        Args:
            user: As the provider says.

        Raises:
            SignOnError: they are shut out here, or there are too many accounts.
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
        told = {"role": account.role, **details}
        self._book.apply(AccessChange(action, account, told, by=self._by))
        return account

    def _invited(self, account: Account, waits_s: float) -> tuple[str, Account]:
        invitation = secrets.token_urlsafe(32)
        digest, until = digest_of(invitation), self._now + waits_s
        return invitation, replace(account, invitation=digest, invited_until=until)

    # --- programs -----------------------------------------------------------------

    def give_token(
        self, name: str, scope: TokenScope, ends_at: float | None = None
    ) -> tuple[str, ApiToken]:
        """Let a program in by a token, which is returned here alone.

        Raises:
            NotANameError: no program may be called so.
            NameTakenError: one is called so already.
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
        change = AccessChange("token_revoked", token, gone=True, by=self._by)
        self._book.apply(change)


def _refuse_name(name: str) -> None:
    if not is_name(name) or is_reserved(name):
        raise NotANameError(name)
