"""``iveg user``: accounts from the machine itself, beside a server or before one."""

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import pytest

from iveg.adapters import clock
from iveg.adapters.access_file import AccessFile
from iveg.adapters.admission import Admission
from iveg.cli import user
from iveg.cli.arguments import CommandCall
from iveg.domain.accounts import Access, AccessBook, Account, PersonRole, digest_of
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import (
    NotANameError,
    ProvidedAccountError,
    SignOnError,
    UnknownNameError,
)
from iveg.settings import Settings
from tests.databases import lay_history


class Console:
    """The command line on one machine; ``book`` is what a server would know."""

    def __init__(self, data: Path) -> None:
        self.settings = Settings(database_url=f"sqlite:///{data / 'history.db'}")
        self._data = data
        assert self.settings.database_url is not None
        lay_history(self.settings.database_url)

    def call(self, action: str, name: str = "", **options: object) -> int:
        told = {"role": "operator", "days": None, **options}
        given = Namespace(action=action, name=name, **told)
        return user.run(CommandCall(given, self.settings, {}, self._data))

    @property
    def left(self) -> list[str]:
        """Actions that wait for the server."""
        file = AccessFile(self._data / "accounts.jsonl")
        return [change.action for _, change in file.left()]

    @property
    def book(self) -> AccessBook:
        book, file = AccessBook(), AccessFile(self._data / "accounts.jsonl")
        for _, change in file.left():
            book.apply(change)
        return book

    def one(self, name: str) -> Account:
        return next(one for one in self.book.accounts.values() if one.name == name)


@pytest.fixture
def console(tmp_path: Path) -> Console:
    return Console(tmp_path)


def invitation_in(out: str) -> str:
    return out.strip().splitlines()[-1].rpartition("#invitation=")[2]


def test_a_person_is_added_by_a_link_of_which_only_a_digest_is_kept(
    console: Console, capsys: pytest.CaptureFixture[str]
) -> None:
    console.call("add", "Ana", role="admin")

    invitation = invitation_in(capsys.readouterr().out)
    assert console.one("Ana").invitation == digest_of(invitation)
    assert console.left == ["account_added"]


def test_who_is_in_the_file_of_a_server_is_found_there(
    console: Console, tmp_path: Path
) -> None:
    known = Account("P1", "Ana", "operator", password="#x")
    file = AccessFile(tmp_path / "accounts.jsonl")
    file.save(Access((known,)))
    file.close()

    console.call("disable", "ANA")

    assert console.one("Ana") == replace(known, disabled=True)


def test_whom_a_provider_vouches_for_is_kept_by_id_and_shut_out_from_here() -> None:
    book = AccessBook()
    told = Account("sso-1a2b3c4d", "Ana", "operator", provider="https://idm.test")
    admission = Admission(book, CONSOLE, clock.wall())

    def vouched(role: PersonRole, name: str = "Ana") -> Account:
        return admission.vouched(replace(told, role=role, name=name))

    admission.add("Ana", "operator")
    vouched("operator")
    again = vouched("viewer")
    admission.disable(again)
    with pytest.raises(SignOnError, match="disabled"):
        vouched("viewer")
    with pytest.raises(ProvidedAccountError):
        admission.give_role(again, "admin")
    invitation, _ = admission.reset(again)

    assert again.name == "Ana 1a2b3c"
    # Sessions of the role before are over.
    assert again.since > 0.0
    assert invitation == ""
    assert vouched("viewer").provider == "https://idm.test"
    reserved = replace(told, account_id="sso-9z8y7x6w", name="Console")
    assert admission.vouched(reserved).name == "Console 9z8y7x"


def test_reset_and_disable_end_sessions(
    console: Console, capsys: pytest.CaptureFixture[str]
) -> None:
    console.call("add", "Ana")
    began = clock.wall()
    for action in ("reset", "disable"):
        console.call(action, "ANA")

    account = console.one("Ana")
    assert account.since >= began
    assert (account.disabled, account.password) == (True, "")
    assert console.left == [
        "account_added",
        "account_reset",
        "account_disabled",
    ]


@pytest.mark.parametrize("name", ["<b>", "Console", "PROGRAM", "iveg", "operator"])
def test_nobody_is_called_as_nobody_can_be_or_as_the_record_calls_others(
    console: Console, name: str
) -> None:
    with pytest.raises(NotANameError):
        console.call("add", name)

    assert console.left == []


def test_nobody_of_an_unknown_name_is_disabled(console: Console) -> None:
    with pytest.raises(UnknownNameError):
        console.call("disable", "Eva")
