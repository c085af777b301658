"""Who is let in: accounts, each change by somebody, from the console or the page.

What people are given to come in with is returned once and stored nowhere: of it only a
digest is kept.
"""

import secrets
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final, Protocol

from iveg.adapters.ids import new_id
from iveg.domain.accounts import (
    Account,
    PersonRole,
    digest_of,
    is_name,
)
from iveg.domain.audit import Actor
from iveg.domain.errors import (
    NameTakenError,
    NotANameError,
    ProvidedAccountError,
    SignOnError,
)
from iveg.domain.retention import DAY_S
from iveg.domain.single_sign_on import another_name

MOST_ACCOUNTS: Final = 1000
INVITED_S: Final = 3 * DAY_S
"""How long an invitation waits (s)."""


class ChangingAccounts(Protocol):
    """Storage that takes changes of accounts; blocks, raises HopError."""

    def add(self, account: Account, by: Actor) -> None:
        """Keep a new account. Raises NameTakenError."""

    def change(self, account: Account, action: str, by: Actor) -> None:
        """Put a new state of an account in the place of the one before."""


class Admission:
    """Changes who may come in.

    Args:
        store: Where accounts are kept.
        by: Who changes them.
        now: This moment (Unix s).
    """

    def __init__(self, store: ChangingAccounts, by: Actor, now: float) -> None:
        self._store = store
        self._by = by
        self._now = now

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
        if not is_name(name):
            raise NotANameError(name)
        account = Account(new_id(), name, role, ends_at=ends_at)
        invitation, invited = self._invited(account, waits_s)
        self._store.add(invited, self._by)
        return invitation, invited

    def reset(
        self, account: Account, waits_s: float = INVITED_S
    ) -> tuple[str, Account]:
        """Take a password away and invite again; sessions end.

        Whom the provider vouches for is let in again, and gets no invitation.
        """
        if account.provider:
            back = replace(account, disabled=False, since=self._now)
            self._store.change(back, "account_reset", self._by)
            return "", back
        reset = replace(account, password="", pin="", disabled=False, since=self._now)
        invitation, invited = self._invited(reset, waits_s)
        self._store.change(invited, "account_reset", self._by)
        return invitation, invited

    def give_role(self, account: Account, role: PersonRole) -> Account:
        """Change a role; sessions end.

        Raises:
            ProvidedAccountError: the provider gives it.
        """
        if account.provider:
            raise ProvidedAccountError(account.name)
        changed = replace(account, role=role, since=self._now)
        self._store.change(changed, "account_role", self._by)
        return changed

    def give_pin(self, account: Account, pin: str) -> Account:
        """Put the hash of a PIN in the place of the one before; empty: none."""
        changed = replace(account, pin=pin)
        action = "pin_changed" if pin else "pin_removed"
        self._store.change(changed, action, self._by)
        return changed

    def disable(self, account: Account) -> Account:
        """Shut somebody out; an invitation that waits is none any more."""
        off = replace(account, disabled=True, invitation="")
        self._store.change(off, "account_disabled", self._by)
        return off

    def vouched(self, known: Mapping[str, Account], user: Account) -> Account:
        """Let somebody in whom a provider vouches for, under the name that they had.

        Another role ends the sessions of the one before.

        Args:
            known: All accounts, by id.
            user: As the provider says.

        Raises:
            SignOnError: they are shut out here, or there are too many accounts.
        """
        account = known.get(user.account_id)
        if account is None:
            return self._vouched_first(known, user)
        if not account.is_open(self._now):
            raise SignOnError("disabled", account.account_id)
        if account.role == user.role:
            return account
        changed = replace(account, role=user.role, since=self._now)
        self._store.change(changed, "account_role", self._by)
        return changed

    def _vouched_first(self, known: Mapping[str, Account], user: Account) -> Account:
        if len(known) >= MOST_ACCOUNTS:
            raise SignOnError("busy", f"{MOST_ACCOUNTS} accounts are there already")
        try:
            self._store.add(user, self._by)
        except NameTakenError:
            user = replace(user, name=another_name(user.name, user.account_id))
            self._store.add(user, self._by)
        return user

    def _invited(self, account: Account, waits_s: float) -> tuple[str, Account]:
        invitation = secrets.token_urlsafe(32)
        digest, until = digest_of(invitation), self._now + waits_s
        return invitation, replace(account, invitation=digest, invited_until=until)


def has_admin(accounts: Iterable[Account], now: float) -> bool:
    """Whether somebody can sign in as admin at this moment (Unix s)."""
    return any(
        one.role == "admin" and one.password and one.is_open(now) for one in accounts
    )
