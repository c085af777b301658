"""Who is told outside iVeg outlives a restart, and its file is nobody else's."""

import stat
from pathlib import Path

import pytest

from iveg.adapters.contacts import FileContacts
from iveg.adapters.push_encryption import new_key
from iveg.domain.contacts import (
    Contacts,
    Email,
    MailRecipient,
    Push,
    SubscribedBrowser,
    Webhook,
)
from iveg.domain.errors import HopError

ALL = Contacts(
    Push(
        True,
        "ana@coop.es",
        (
            SubscribedBrowser(
                "D1", "Ana", "https://push.example/1", "k", "s", "es", 12.5
            ),
        ),
        new_key(),
    ),
    Email(
        on=True,
        server="smtp.coop.es",
        user="iveg",
        password="tomato",
        sender="iveg@coop.es",
        recipients=(MailRecipient("Ana", "ana@coop.es"),),
        least="P2",
    ),
    Webhook(True, "Guardia", "https://hooks.coop.es/secret"),
)


async def test_contacts_come_back_whole(tmp_path: Path) -> None:
    await FileContacts(tmp_path / "contacts.jsonl").save(ALL)

    assert FileContacts(tmp_path / "contacts.jsonl").load() == ALL


async def test_their_file_is_readable_by_its_owner_alone(tmp_path: Path) -> None:
    file = tmp_path / "contacts.jsonl"

    await FileContacts(file).save(ALL)

    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_without_a_file_nobody_is_told(tmp_path: Path) -> None:
    assert FileContacts(tmp_path / "contacts.jsonl").load() == Contacts()


def test_a_file_that_cannot_be_read_is_put_aside_and_nobody_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "contacts.jsonl"
    file.write_text('{"email": {"password": "tomato", "port": "x"}}\n')

    assert FileContacts(file).load() == Contacts()

    assert (tmp_path / "contacts.jsonl.unreadable").exists()
    assert "put aside" in caplog.text
    assert "tomato" not in caplog.text


async def test_a_full_disk_keeps_those_of_before(tmp_path: Path) -> None:
    with pytest.raises(HopError):
        await FileContacts(tmp_path / "nowhere" / "contacts.jsonl").save(ALL)


def test_no_secret_is_in_what_is_printed_of_them() -> None:
    printed = repr(ALL)

    assert "tomato" not in printed
    assert "secret" not in printed
    assert ALL.push.key not in printed
