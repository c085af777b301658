"""Passkeys in the history's database; each change with its row of the audit."""

from collections.abc import Iterable
from dataclasses import asdict

from sqlalchemy import Connection, delete, insert, select, update

from iveg.adapters.history.named_rows import KeyedRows, note_change
from iveg.adapters.history.tables import passkeys
from iveg.domain.audit import Actor
from iveg.domain.errors import NameTakenError, UnknownNameError
from iveg.domain.passkeys import Passkey


class PasskeyStore(KeyedRows[Passkey]):
    """Reads, by credential id, and changes passkeys."""

    def __init__(self, database_url: str) -> None:
        super().__init__(database_url, passkeys, Passkey, "credential_id")

    def add(self, passkey: Passkey, by: Actor) -> None:
        """Keep a new passkey.

        Raises:
            NameTakenError: this very credential is kept already.
        """
        c = passkeys.c.credential_id
        known = select(c).where(c == passkey.credential_id)

        def work(connection: Connection) -> bool:
            if connection.execute(known).first() is not None:
                return False
            connection.execute(insert(passkeys).values(**asdict(passkey)))
            details = {"rp_id": passkey.rp_id}
            note_change(connection, by, "passkey_added", passkey.name, details)
            return True

        if not self._store.run(work):
            raise NameTakenError(passkey.name)

    def remove(self, account_id: str, credential_id: str, by: Actor) -> None:
        """Forget a passkey of this person.

        Raises:
            UnknownNameError: they have no such passkey.
        """
        c = passkeys.c
        own = (c.account_id == account_id) & (c.credential_id == credential_id)

        def work(connection: Connection) -> bool:
            name = connection.scalar(select(c.name).where(own))
            if name is None:
                return False
            connection.execute(delete(passkeys).where(own))
            note_change(connection, by, "passkey_removed", name, {})
            return True

        if not self._store.run(work):
            raise UnknownNameError("passkey", credential_id)

    def used(self, used: Iterable[Passkey]) -> None:
        """Keep counts and times of use."""
        c = passkeys.c.credential_id

        def work(connection: Connection) -> None:
            for one in used:
                wanted = update(passkeys).where(c == one.credential_id)
                kept = {"sign_count": one.sign_count, "used_at": one.used_at}
                connection.execute(wanted.values(**kept))

        self._store.run(work)
