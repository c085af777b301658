"""Accounts in memory, and passwords that are checked without Argon2."""

from collections.abc import Mapping
from dataclasses import replace

from iveg.adapters.passwords import Passwords
from iveg.domain.accounts import Account
from iveg.domain.errors import HopError


class FakeAccounts:
    """Implements ``web.security.people.Accounts``."""

    def __init__(self, *known: Account) -> None:
        self.known = {one.account_id: one for one in known}
        self.is_away = False

    def read(self) -> Mapping[str, Account]:
        if self.is_away:
            raise HopError("database", "away")
        return dict(self.known)

    def accept(self, digest: str, password: str, now: float) -> Account | None:
        for one in self.known.values():
            if one.invitation == digest and one.invited_until > now:
                begun = replace(one, password=password, invitation="", since=now)
                self.known[one.account_id] = begun
                return begun
        return None


class FakePasswords(Passwords):
    """Keeps a password with a mark before it; ``asked`` counts the checks."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[str] = []

    async def hashed(self, password: str) -> str:
        return f"#{password}"

    async def fits(self, password: str, kept: str) -> bool:
        self.asked.append(kept)
        return kept == f"#{password}"
