"""Accounts in the history's database; each change with its row of the audit."""

from collections.abc import Mapping
from dataclasses import asdict

from sqlalchemy import Connection, insert, select, update
from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from iveg.adapters import clock
from iveg.adapters.history.audit import write_audit
from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.migrate import reason_of
from iveg.adapters.history.store import Store
from iveg.adapters.history.tables import accounts
from iveg.adapters.ids import new_id
from iveg.domain.accounts import Account, name_key
from iveg.domain.audit import Actor, canonical
from iveg.domain.errors import HopError, NameTakenError
from iveg.domain.records import AuditRecord, Json

_COLUMNS = [one for one in accounts.c if one.key != "name_key"]


class AccountStore:
    """Reads and changes accounts; blocks, so a server calls it in a thread.

    Every method raises ``HopError`` when the database does not answer.
    """

    def __init__(self, database_url: str) -> None:
        self._store = Store(database_url)
        self._reading = reading_engine(database_url)

    def read(self) -> Mapping[str, Account]:
        """All accounts, by id."""
        try:
            with self._reading.connect() as connection:
                rows = connection.execute(select(*_COLUMNS)).mappings()
                return {row["account_id"]: Account(**row) for row in rows}
        except SQLAlchemyError as error:
            raise HopError("database", reason_of(error)) from error

    def add(self, account: Account, by: Actor) -> None:
        """Keep a new account.

        Raises:
            NameTakenError: somebody is called so already.
        """
        values = asdict(account) | {"name_key": name_key(account.name)}

        def work(connection: Connection) -> bool:
            try:
                with connection.begin_nested():
                    connection.execute(insert(accounts).values(**values))
            except IntegrityError:
                return False
            told = {"role": account.role, "ends_at": account.ends_at}
            note_change(connection, by, "account_added", account.name, told)
            return True

        if not self._store.run(work):
            raise NameTakenError(account.name)

    def change(self, account: Account, action: str, by: Actor) -> None:
        """Put a new state of an account in the place of the one before."""

        def work(connection: Connection) -> None:
            wanted = update(accounts).where(accounts.c.account_id == account.account_id)
            connection.execute(wanted.values(**asdict(account)))
            told = {"role": account.role}
            note_change(connection, by, action, account.name, told)

        self._store.run(work)

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
            row = connection.execute(select(*_COLUMNS).where(waits)).mappings().first()
            if row is None or not digest:
                return None
            taken = {"password": password, "invitation": "", "since": now}
            account = Account(**{**row, **taken})
            wanted = update(accounts).where(c.account_id == account.account_id)
            connection.execute(wanted.values(**taken))
            return account

        return self._store.run(work)

    def close(self) -> None:
        """Let go of the connections."""
        self._store.close()
        self._reading.dispose()


def note_change(
    connection: Connection, by: Actor, action: str, name: str, told: Json
) -> None:
    """Write a change of somebody's rights into the audit, in the same transaction."""
    now = clock.wall()
    row = AuditRecord(
        audit_id=new_id(),
        at=now,
        person=by.person,
        name=by.name,
        role=by.role,
        method=by.method,
        action=action,
        subject=name,
        details=canonical(told),
    )
    write_audit(connection, [row], now)
