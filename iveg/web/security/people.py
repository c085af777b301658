"""People with accounts: their passwords and invitations, and what their sessions are.

Accounts are read anew twice a second, so that who is disabled at the console is out of
every page within a second.  While the database is away the last that was read counts;
before the first reading a session may stop and no more.
"""

import contextlib
from collections.abc import Callable, Mapping
from functools import partial
from typing import Protocol, TypeVar

from iveg.adapters.admission import Admission, ChangingAccounts, has_admin
from iveg.adapters.passwords import Passwords
from iveg.adapters.sessions import Session
from iveg.domain.accounts import Account, Language, digest_of, name_key
from iveg.domain.audit import Actor, NamedActor
from iveg.domain.errors import HopError
from iveg.pipeline.ports import Clock
from iveg.web.security.rereading import Rereading
from iveg.web.security.roles import Role

_T = TypeVar("_T")


class AccountRows(ChangingAccounts, Protocol):
    """Accounts within one transaction."""

    def read(self) -> Mapping[str, Account]:
        """All accounts, by id, which nobody else changes meanwhile."""


class Accounts(Protocol):
    """Storage of accounts; blocks, and raises HopError while it is away."""

    def read(self) -> Mapping[str, Account]:
        """All accounts, by id."""

    def together(self, work: Callable[[AccountRows], _T]) -> _T:
        """Read and change in one transaction; what raises changes nothing."""

    def accept(self, digest: str, password: str, now: float) -> Account | None:
        """Exchange an invitation for a password, once; None where it is none."""

    def change_password(
        self, by: Actor, was: str, password: str, now: float
    ) -> Account | None:
        """Put a hash in the place of another; None where that is kept no longer."""

    def choose_language(self, person: str, language: Language) -> None:
        """Keep what somebody reads."""


class People(Rereading):
    """Knows who may sign in, and which sessions still stand.

    Args:
        store: Where accounts are kept.
        passwords: Checks passwords.
        clock: Read at each question.
    """

    def __init__(self, store: Accounts, passwords: Passwords, clock: Clock) -> None:
        super().__init__("accounts")
        self._store = store
        self._passwords = passwords
        self._clock = clock
        self._known: Mapping[str, Account] | None = None

    async def refresh(self) -> None:
        """Read them once. Raises HopError."""
        self._known = await self._apart(self._store.read)

    def is_led(self) -> bool:
        """Whether somebody can sign in as admin; before the first reading, too."""
        if self._known is None:
            return True
        return has_admin(self._known.values(), self._clock().wall)

    async def known(self) -> Mapping[str, Account]:
        """All accounts as they are kept now, by id. Raises HopError."""
        await self.refresh()
        return self._known or {}

    async def change(
        self, by: Actor, work: Callable[[Admission, Mapping[str, Account]], _T]
    ) -> _T:
        """Change accounts; counts at once, here and in every session.

        Args:
            by: Who changes them.
            work: Called in a thread and one transaction, with all accounts by id.

        Raises:
            HopError: the database is away; nothing was changed.
        """
        now = self._clock().wall

        def change(rows: AccountRows) -> _T:
            return work(Admission(rows, by, now), rows.read())

        done = await self._apart(lambda: self._store.together(change))
        with contextlib.suppress(HopError):
            await self.refresh()
        return done

    def role_now(self, session: Session, left: Role) -> Role | None:
        """The role that an account leaves a session; None: it is over at once.

        Args:
            session: Somebody's, who came with a password or by the provider.
            left: The role that its age leaves.
        """
        if self._known is None:
            return "expired"
        account = self.find(session.person)
        if account is None or not account.is_open(self._clock().wall):
            return None
        return left if session.began >= account.since else None

    def present(self) -> list[Account]:
        """Those who may be here and have begun."""
        now = self._clock().wall
        known = (self._known or {}).values()
        return [one for one in known if one.state(now) == "active"]

    def account(self, account_id: str) -> Account | None:
        """Somebody's account; None where they may not be here, or have not begun."""
        account = self.find(account_id)
        begun = account is not None and account.state(self._clock().wall) == "active"
        return account if begun else None

    def find(self, person: str) -> Account | None:
        """The account of this id, as it was read last."""
        return (self._known or {}).get(person)

    async def sign_in(self, name: str, password: str) -> Account | None:
        """The account of this name and password; None takes as long.

        Raises:
            BusyError: too many sign in at once.
        """
        key, now = name_key(name), self._clock().wall
        known = (self._known or {}).values()
        found = next((one for one in known if name_key(one.name) == key), None)
        fits = await self._passwords.fits(password, found.password if found else "")
        return found if found and fits and found.is_open(now) else None

    async def vouched(self, user: Account) -> Account:
        """The account of somebody whom the provider vouches for; made where needed.

        Raises:
            SignOnError: they are shut out here.
            HopError: the database is away.
        """
        by = NamedActor(user.account_id, user.name, user.role, "sso")
        return await self.change(by, lambda one, known: one.vouched(known, user))

    async def proven(self, account: Account, password: str) -> Account | None:
        """The same account where the password is its own. Raises BusyError."""
        fits = await self._passwords.fits(password, account.password)
        return account if fits else None

    async def has_pin(self, account: Account, pin: str) -> bool:
        """Whether a PIN is this person's. Raises BusyError."""
        return await self._passwords.fits(pin, account.pin)

    async def give_pin(self, by: Actor, account: Account, pin: str) -> None:
        """Let a PIN unlock tablets as this person; an empty one takes theirs away.

        Raises:
            BusyError: too many sign in at once.
            HopError: the database is away; nothing was changed.
        """
        kept = await self._passwords.hashed(pin) if pin else ""
        person = account.account_id
        await self.change(by, lambda one, known: one.give_pin(known[person], kept))

    async def accept(self, invitation: str, password: str) -> Account | None:
        """Begin an account by its invitation; None where that is none any more.

        Raises:
            BusyError: too many sign in at once.
            HopError: the database is away.
        """
        digest, now = digest_of(invitation), self._clock().wall
        if not any(one.invitation == digest for one in (self._known or {}).values()):
            return None
        kept = await self._passwords.hashed(password)
        account = await self._apart(partial(self._store.accept, digest, kept, now))
        await self.refresh()
        return account

    async def change_password(self, who: Actor, old: str, new: str) -> Account | None:
        """Give somebody a new password; None where the old one is wrong.

        Raises:
            BusyError: too many sign in at once.
            HopError: the database is away.
        """
        account = self.find(who.person)
        was = account.password if account else ""
        if not await self._passwords.fits(old, was):
            return None
        kept, now = await self._passwords.hashed(new), self._clock().wall
        work = partial(self._store.change_password, who, was, kept, now)
        changed = await self._apart(work)
        await self.refresh()
        return changed

    async def choose_language(self, person: str, language: Language) -> None:
        """Keep what somebody reads. Raises HopError."""
        await self._apart(partial(self._store.choose_language, person, language))
        await self.refresh()

    def close(self) -> None:
        """End the threads."""
        super().close()
        self._passwords.close()
