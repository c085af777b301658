"""Accounts that were known before stay known, and their file is looked after."""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from iveg.adapters.access_file import AccessFile
from iveg.domain.accounts import AccessChange, Account, ApiToken
from iveg.domain.errors import HopError
from iveg.domain.records import AuditRecord
from iveg.vital.audit import AuditTrail
from iveg.vital.supervision import Supervision
from iveg.web.security.accounts import Accounts
from tests.databases import lay_history, put_into_tables
from tests.fakes.clock import FakeClock
from tests.fakes.recorder import FakeRecorder

ANA = Account("P1", "Ana", "operator", password="#hash")
MES = ApiToken("T1", "MES", "stop", "ab" * 32, 1.0)


class House:
    """A data directory in which accounts are opened, one after the other."""

    def __init__(self, folder: Path, url: str) -> None:
        self.folder, self.url = folder, url
        self.path = folder / "accounts.jsonl"
        self.clock = FakeClock()
        self.sink = FakeRecorder()
        self.supervision = Supervision(self.clock)
        self._opened: list[Accounts] = []

    def open(self) -> Accounts:
        self.close()
        ids = iter(f"id-{number}" for number in range(100))
        trail = AuditTrail(self.sink, lambda: next(ids))
        accounts = Accounts(
            AccessFile(self.path), self.url, trail, self.supervision, self.clock
        )
        self._opened.append(accounts)
        return accounts

    def close(self) -> None:
        while self._opened:
            self._opened.pop().close()

    def acts(self) -> list[tuple[str, str, str]]:
        rows = [one for one in self.sink.records if isinstance(one, AuditRecord)]
        return [(one.action, one.subject, one.name) for one in rows]

    def keys(self) -> list[str]:
        return [one.key for one in self.supervision.conditions(self.clock())]


@pytest.fixture
def house(tmp_path: Path) -> Iterator[House]:
    url = f"sqlite:///{tmp_path / 'history.db'}"
    lay_history(url)
    house = House(tmp_path / "data", url)
    yield house
    house.close()


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(30):
        while not holds():  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def test_who_was_in_the_tables_is_copied_once(house: House) -> None:
    put_into_tables(house.url, ANA, MES)

    first = house.open()
    with pytest.raises(HopError):
        first.first_invitation()
    await first.copy_earlier()
    revoked = AccessChange("token_revoked", MES, gone=True)
    first.book.apply(revoked)
    # With a file no database is asked any more: an older one brings nobody back.
    house.url, url = "sqlite:////nowhere/history.db", house.url
    again = house.open()
    await again.copy_earlier()

    assert (again.book.accounts, again.book.tokens) == ({"P1": ANA}, {})
    # Nor does it come back where somebody takes the file away.
    house.close()
    house.path.unlink()
    house.url = url
    third = house.open()
    await third.copy_earlier()
    assert third.book.accounts == {}


async def test_the_first_admin_is_invited_anew_for_half_an_hour_until_there_is_one(
    house: House,
) -> None:
    accounts = house.open()
    await accounts.copy_earlier()
    links = [accounts.first_invitation() or "" for _ in range(2)]
    replaced = await accounts.people.accept(links[0], "berenjena-77")
    house.clock.now += 1801.0
    late = await accounts.people.accept(links[1], "berenjena-77")
    begun = await accounts.people.accept(
        accounts.first_invitation() or "", "berenjena-77"
    )

    assert (replaced, late) == (None, None)
    assert begun is not None
    assert begun.role == "admin"
    assert accounts.first_invitation() is None


async def test_a_change_of_the_console_counts_at_once_and_has_its_row(
    house: House,
) -> None:
    accounts = house.open()
    await accounts.copy_earlier()
    accounts.book.put(ANA)
    console = AccessFile(house.path)
    running = asyncio.create_task(accounts.run())

    off = replace(ANA, disabled=True)
    console.leave(AccessChange("account_disabled", off))
    console.leave(AccessChange("account_added", replace(ANA, account_id="P2")))
    await until(lambda: bool(house.acts()))
    await accounts._file.look()
    running.cancel()
    with suppress(asyncio.CancelledError):
        await running

    # A second one of that name was left out.
    assert accounts.book.accounts == {"P1": off}
    assert house.acts() == [("account_disabled", "Ana", "console")]
    assert AccessFile(house.path).read()[0].accounts == (off,)
    console.close()


async def test_a_damaged_file_is_told_until_somebody_takes_it_away(
    house: House,
) -> None:
    accounts = house.open()
    await accounts.copy_earlier()
    accounts.book.put(ANA)
    # No writing of it is on its way any more.
    await accounts._file.look()
    running = asyncio.create_task(accounts.run())

    house.path.write_bytes(b"junk")
    await until(lambda: house.keys() == ["alert.accounts_damaged"])
    told = accounts.state
    (aside,) = house.folder.glob("*.damaged-*")
    aside.unlink()
    await until(lambda: house.keys() == [])
    running.cancel()
    with suppress(asyncio.CancelledError):
        await running

    assert (told, accounts.state) == ("damaged", "ok")
    assert AccessFile(house.path).read()[0].accounts == (ANA,)
