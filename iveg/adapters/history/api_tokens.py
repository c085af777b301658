"""Tokens of programs in the history's database; each change with its audit row."""

from collections.abc import Mapping

from sqlalchemy import Connection, delete, update

from iveg.adapters.history.named_rows import NamedRows, note_change
from iveg.adapters.history.tables import api_tokens
from iveg.domain.accounts import ApiToken, name_key
from iveg.domain.audit import Actor
from iveg.domain.errors import UnknownNameError


class ApiTokenStore(NamedRows[ApiToken]):
    """Reads, by digest, and changes tokens."""

    def __init__(self, database_url: str) -> None:
        super().__init__(database_url, api_tokens, ApiToken, "digest")

    def add(self, token: ApiToken, by: Actor) -> None:
        """Keep a new token.

        Raises:
            NameTakenError: a program is called so already.
        """
        details = {"scope": token.scope, "ends_at": token.ends_at}
        self._add(token, by, "token_added", details)

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
