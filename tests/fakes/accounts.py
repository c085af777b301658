"""Accounts whose changes are written down, and passwords checked without Argon2."""

from iveg.adapters.passwords import Passwords
from iveg.domain.accounts import Access, AccessBook, Account, ApiToken


class FakeBook(AccessBook):
    """Knows these from the start; ``changes`` are action, name and by whom."""

    def __init__(self, *known: Account | ApiToken) -> None:
        people = tuple(one for one in known if isinstance(one, Account))
        programs = tuple(one for one in known if isinstance(one, ApiToken))
        super().__init__(Access(people, programs))
        self.changes: list[tuple[str, str, str]] = []
        self.on_change.append(
            lambda one: self.changes.append((one.action, one.row.name, one.by.name))
        )


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
