"""People with accounts, and programs with tokens of their own, held in memory."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from iveg.adapters.admission import Admission
from iveg.adapters.passwords import Passwords
from iveg.domain.accounts import (
    AccessBook,
    Account,
    TokenScope,
    digest_of,
    find_named,
)
from iveg.domain.audit import Actor
from iveg.vital.ports import Clock
from iveg.web.security.roles import Principal, Role

_ROLES: Final[Mapping[TokenScope, Role]] = {
    "read": "reader",
    "stop": "program",
    "operate": "controller",
}
_USED_S = 60.0
"""Precision of the last use of a token (s): each use would write the file."""


class People:
    """People who may sign in, and programs that may call.

    Args:
        book: Has accounts and tokens.
        passwords: Checks passwords.
        clock: Read at each question.
    """

    def __init__(self, book: AccessBook, passwords: Passwords, clock: Clock) -> None:
        self.book, self.clock = book, clock
        self._passwords = passwords

    @property
    def known(self) -> Mapping[str, Account]:
        """All accounts, by id."""
        return self.book.accounts

    def is_led(self) -> bool:
        """Whether somebody can sign in as admin."""
        now = self.clock().wall
        return any(
            account.role == "admin" and account.password and account.is_open(now)
            for account in self.known.values()
        )

    def admission(self, by: Actor) -> Admission:
        """Changes of accounts and tokens in the name of ``by``; each counts at once."""
        return Admission(self.book, by, self.clock().wall)

    async def sign_in(self, name: str, password: str) -> Account | None:
        """The account of this name and password; None takes as long.

        Raises:
            BusyError: too many sign in at once.
        """
        account = find_named(self.known.values(), name)
        # Also without an account: the time must not reveal which names exist.
        fits = await self._passwords.fits(password, account.password if account else "")
        if not account or not fits:
            return None
        # The account may have been changed while the password was checked.
        now = self.known.get(account.account_id)
        is_same = now is not None and now.password == account.password
        return now if now and is_same and now.is_open(self.clock().wall) else None

    async def accept(self, invitation: str, password: str) -> Account | None:
        """Begin an account by its invitation; None where the invitation has ended.

        Raises:
            BusyError: too many sign in at once.
        """
        digest = digest_of(invitation)
        if self._invited(digest) is None:
            return None
        hashed = await self._passwords.hashed(password)
        # Again: somebody else may have used or ended it while the password was hashed.
        account = self._invited(digest)
        if account is None:
            return None
        now = self.clock().wall
        begun = replace(account, password=hashed, invitation="", since=now)
        self.book.put(begun)
        return begun

    def _invited(self, digest: str) -> Account | None:
        now = self.clock().wall
        for account in self.known.values():
            is_waiting = account.invited_until > now and not account.disabled
            if account.invitation == digest and is_waiting:
                return account
        return None

    async def change_password(self, who: Actor, old: str, new: str) -> Account | None:
        """Give a person a new password; None where the old password is wrong.

        Raises:
            BusyError: too many sign in at once.
        """
        account = self.known.get(who.person)
        was = account.password if account else ""
        if not await self._passwords.fits(old, was):
            return None
        hashed = await self._passwords.hashed(new)
        # Again: an admin may have reset or disabled it while the password was hashed.
        account = self.known.get(who.person)
        if account is None or account.password != was or account.disabled:
            return None
        return self.admission(who).give_password(account, hashed)

    def program(self, token: str) -> Principal | None:
        """The program of a token; None: unknown, or no longer valid."""
        known, now = self.book.tokens.get(digest_of(token)), self.clock().wall
        if known is None or not known.is_open(now):
            return None
        if known.used_at is None or abs(now - known.used_at) >= _USED_S:
            self.book.tokens[known.digest] = replace(known, used_at=now)
            self.book.keep()
        return Principal(known.name, _ROLES[known.scope], known.token_id, "token")

    def close(self) -> None:
        """End the thread of passwords."""
        self._passwords.close()
