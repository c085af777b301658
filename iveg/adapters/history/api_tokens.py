"""Tokens of programs in the history's database; each change with its audit row."""

from collections.abc import Mapping
from dataclasses import asdict

from sqlalchemy import Connection, delete, insert, select, update
from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from iveg.adapters.history.accounts import note_change
from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.migrate import reason_of
from iveg.adapters.history.store import Store
from iveg.adapters.history.tables import api_tokens
from iveg.domain.accounts import ApiToken, name_key
from iveg.domain.audit import Actor
from iveg.domain.errors import HopError, NameTakenError, UnknownNameError

_COLUMNS = [one for one in api_tokens.c if one.key != "name_key"]


class ApiTokenStore:
    """Reads and changes tokens; blocks, so a server calls it in a thread.

    Every method raises ``HopError`` when the database does not answer.
    """

    def __init__(self, database_url: str) -> None:
        self._store = Store(database_url)
        self._reading = reading_engine(database_url)

    def read(self) -> Mapping[str, ApiToken]:
        """All tokens, by their digests."""
        try:
            with self._reading.connect() as connection:
                rows = connection.execute(select(*_COLUMNS)).mappings()
                return {row["digest"]: ApiToken(**row) for row in rows}
        except SQLAlchemyError as error:
            raise HopError("database", reason_of(error)) from error

    def add(self, token: ApiToken, by: Actor) -> None:
        """Keep a new token.

        Raises:
            NameTakenError: a program is called so already.
        """
        values = asdict(token) | {"name_key": name_key(token.name)}

        def work(connection: Connection) -> bool:
            try:
                with connection.begin_nested():
                    connection.execute(insert(api_tokens).values(**values))
            except IntegrityError:
                return False
            told = {"scope": token.scope}
            note_change(connection, by, "token_added", token.name, told)
            return True

        if not self._store.run(work):
            raise NameTakenError(token.name)

    def revoke(self, name: str, by: Actor) -> None:
        """Delete a token.

        Raises:
            UnknownNameError: no program is called so.
        """
        gone = delete(api_tokens).where(api_tokens.c.name_key == name_key(name))

        def work(connection: Connection) -> bool:
            found = connection.execute(gone).rowcount > 0
            if found:
                note_change(connection, by, "token_revoked", name, {})
            return found

        if not self._store.run(work):
            raise UnknownNameError("token", name)

    def used(self, digests: Mapping[str, float]) -> None:
        """Keep when tokens were used last (Unix s)."""

        def work(connection: Connection) -> None:
            for digest, at in digests.items():
                wanted = update(api_tokens).where(api_tokens.c.digest == digest)
                connection.execute(wanted.values(used_at=at))

        self._store.run(work)

    def close(self) -> None:
        """Let go of the connections."""
        self._store.close()
        self._reading.dispose()
