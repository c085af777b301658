"""Accounts and passkeys in memory, and passwords that are checked without Argon2."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TypeVar

from iveg.adapters.passwords import Passwords
from iveg.domain.accounts import Account, Language, name_key
from iveg.domain.audit import Actor
from iveg.domain.errors import HopError, NameTakenError, UnknownNameError
from iveg.domain.passkeys import Passkey

_T = TypeVar("_T")


class FakeAccounts:
    """Implements ``web.security.people.Accounts``."""

    def __init__(self, *known: Account) -> None:
        self.known = {one.account_id: one for one in known}
        self.is_away = False
        self.changes: list[tuple[str, str, str]] = []

    def read(self) -> Mapping[str, Account]:
        if self.is_away:
            raise HopError("database", "away")
        return dict(self.known)

    def together(self, work: Callable[["FakeAccounts"], _T]) -> _T:
        return work(self)

    def add(self, account: Account, by: Actor) -> None:
        keys = {name_key(one.name) for one in self.known.values()}
        if name_key(account.name) in keys:
            raise NameTakenError(account.name)
        self.known[account.account_id] = account
        self.changes.append(("account_added", account.name, by.name))

    def change(self, account: Account, action: str, by: Actor) -> None:
        self.known[account.account_id] = account
        self.changes.append((action, account.name, by.name))

    def accept(self, digest: str, password: str, now: float) -> Account | None:
        for one in self.known.values():
            if one.invitation == digest and one.invited_until > now:
                begun = replace(one, password=password, invitation="", since=now)
                self.known[one.account_id] = begun
                return begun
        return None

    def change_password(
        self, by: Actor, was: str, password: str, now: float
    ) -> Account | None:
        if self.is_away:
            raise HopError("database", "away")
        known = self.known.get(by.person)
        if known is None or known.password != was or not was:
            return None
        changed = replace(known, password=password, since=now)
        self.known[by.person] = changed
        self.changes.append(("password_changed", known.name, by.name))
        return changed

    def choose_language(self, person: str, language: Language) -> None:
        if self.is_away:
            raise HopError("database", "away")
        self.known[person] = replace(self.known[person], language=language)


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


class FakePasskeys:
    """Implements ``web.security.passkeys.StoredPasskeys``."""

    def __init__(self) -> None:
        self.known: dict[str, Passkey] = {}
        self.is_away = False
        self.changes: list[tuple[str, str, str]] = []

    def read(self) -> Mapping[str, Passkey]:
        if self.is_away:
            raise HopError("database", "away")
        return dict(self.known)

    def add(self, passkey: Passkey, by: Actor) -> None:
        if passkey.credential_id in self.known:
            raise NameTakenError(passkey.name)
        self.known[passkey.credential_id] = passkey
        self.changes.append(("passkey_added", passkey.name, by.name))

    def remove(self, account_id: str, credential_id: str, by: Actor) -> None:
        kept = self.known.get(credential_id)
        if kept is None or kept.account_id != account_id:
            raise UnknownNameError("passkey", credential_id)
        del self.known[credential_id]
        self.changes.append(("passkey_removed", kept.name, by.name))

    def used(self, used: Iterable[Passkey]) -> None:
        self.known.update({one.credential_id: one for one in used})
