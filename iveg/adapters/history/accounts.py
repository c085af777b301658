"""Accounts in the history's database; each change with its row of the audit."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import TypeVar

from sqlalchemy import Connection, delete, select, update

from iveg.adapters.history.named_rows import NamedRows, add_row, note_change
from iveg.adapters.history.tables import accounts, passkeys
from iveg.domain.accounts import Account, Language
from iveg.domain.audit import Actor

_T = TypeVar("_T")


class AccountRows:
    """Accounts within one transaction: what was read stays so until it is over."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def read(self) -> Mapping[str, Account]:
        """All accounts, by id, which nobody else changes meanwhile."""
        columns = [one for one in accounts.c if one.key != "name_key"]
        # SQLite has one writer at a time, and no such words.
        wanted = select(*columns).with_for_update()
        rows = self._connection.execute(wanted).mappings()
        return {row["account_id"]: Account(**row) for row in rows}

    def add(self, account: Account, by: Actor) -> None:
        """Keep a new account.

        Raises:
            NameTakenError: somebody is called so already.
        """
        details = {"role": account.role, "ends_at": account.ends_at}
        add_row(self._connection, accounts, account, by, "account_added", details)

    def change(self, account: Account, action: str, by: Actor) -> None:
        """Put a new state of an account in the place of the one before."""
        wanted = update(accounts).where(accounts.c.account_id == account.account_id)
        self._connection.execute(wanted.values(**asdict(account)))
        note_change(self._connection, by, action, account.name, {"role": account.role})


class AccountStore(NamedRows[Account]):
    """Reads, by id, and changes accounts."""

    def __init__(self, database_url: str) -> None:
        super().__init__(database_url, accounts, Account, "account_id")

    def together(self, work: Callable[[AccountRows], _T]) -> _T:
        """Read and change in one transaction; what raises changes nothing."""
        return self._store.run(lambda connection: work(AccountRows(connection)))

    def change_password(
        self, by: Actor, was: str, password: str, now: float
    ) -> Account | None:
        """Put a hash in the place of another; None where that is kept no longer.

        Args:
            by: Whose it is.
            was: The hash that they have proved to know the password of.
            password: Hash to keep.
            now: This moment (Unix s); sessions that began before are over.
        """
        c = accounts.c

        def work(connection: Connection) -> Account | None:
            same = (c.account_id == by.person) & (c.password == was) & ~c.disabled
            taken = {"password": password, "since": now}
            if (
                not was
                or not connection.execute(
                    update(accounts).where(same).values(**taken)
                ).rowcount
            ):
                return None
            wanted = select(*self._columns).where(c.account_id == by.person)
            account = Account(**connection.execute(wanted).mappings().one())
            note_change(connection, by, "password_changed", account.name, {})
            return account

        return self._store.run(work)

    def choose_language(self, person: str, language: Language) -> None:
        """Keep what somebody reads."""
        same = accounts.c.account_id == person
        wanted = update(accounts).where(same).values(language=language)
        self._store.run(lambda connection: connection.execute(wanted))

    def accept(self, digest: str, password: str, now: float) -> Account | None:
        """Exchange an invitation for a password, once; None where it is none.

        Args:
            digest: SHA-256 of the invitation (hex).
            password: Hash to keep.
            now: This moment (Unix s).
        """
        c = accounts.c

        def work(connection: Connection) -> Account | None:
            waits = (c.invitation == digest) & (c.invited_until > now) & ~c.disabled
            wanted = select(*self._columns).where(waits)
            row = connection.execute(wanted).mappings().first()
            if row is None or not digest:
                return None
            taken = {"password": password, "invitation": "", "since": now, "pin": ""}
            account = Account(**{**row, **taken})
            same = c.account_id == account.account_id
            connection.execute(update(accounts).where(same).values(**taken))
            # Whoever was reset may have lost the device that still has one.
            gone = passkeys.c.account_id == account.account_id
            connection.execute(delete(passkeys).where(gone))
            return account

        return self._store.run(work)
