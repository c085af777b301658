"""The file of who may come in: read as far as it can be, and written from memory."""

import stat
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from iveg.adapters.access_file import AccessFile
from iveg.domain.accounts import Access, AccessChange, Account, ApiToken, Session

ANA = Account("P1", "Ana", "operator", password="#hash", since=12.5)
MES = ApiToken("T1", "MES", "stop", "ab" * 32, 1.0)
KEPT = Access((ANA,), (MES,), (Session("cd" * 32, "Ana", "operator", 1.0, "P1"),))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "accounts.jsonl"


@pytest.fixture
def file(path: Path) -> Iterator[AccessFile]:
    file = AccessFile(path)
    yield file
    file.close()


def written(path: Path) -> None:
    file = AccessFile(path)
    file.save(KEPT)
    file.close()


CHANGES: dict[str, Callable[[bytes], bytes]] = {
    "emptied": lambda _: b"",
    "junk": lambda _: bytes(range(256)) * 40,
    "cut in a line": lambda old: old[:-40],
    "cut between lines": lambda old: b"\n".join(old.splitlines()[:-1]) + b"\n",
    "without its head": lambda old: b"\n".join(old.splitlines()[1:]),
    "no role": lambda old: old.replace(b"operator", b"oper\xe1tor"),
}


def _damaged(path: Path, how: str) -> None:
    if how in CHANGES:
        path.write_bytes(CHANGES[how](path.read_bytes()))
    else:
        path.unlink()
    if how == "a folder":
        path.mkdir()
        (path / "inside").touch()


def test_all_of_it_is_read_as_it_was_written_and_by_its_owner_alone(
    path: Path, file: AccessFile
) -> None:
    written(path)

    assert file.load() == KEPT
    assert file.aside == []
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


@pytest.mark.parametrize("how", [*CHANGES, "a folder"])
def test_a_file_that_was_damaged_is_put_aside_and_what_is_whole_is_read(
    path: Path, file: AccessFile, how: str
) -> None:
    written(path)
    _damaged(path, how)

    found = file.load()

    # Nothing that was not written is believed.
    assert set(found.accounts) <= {ANA}
    assert set(found.tokens) <= {MES}
    (aside,) = file.aside
    assert aside.startswith("accounts.jsonl.damaged-")


@pytest.mark.parametrize("how", [*CHANGES, "a folder", "taken away"])
async def test_what_happens_to_it_while_iveg_runs_is_written_anew_from_memory(
    path: Path, file: AccessFile, how: str
) -> None:
    file.save(KEPT)
    await file.look()
    _damaged(path, how)

    await file.look()
    await file.look()

    assert len(file.aside) == (how != "taken away")
    assert AccessFile(path).read() == (KEPT, True)


async def test_a_disk_that_fails_is_told_once_and_tried_again(
    path: Path, file: AccessFile, caplog: pytest.LogCaptureFixture
) -> None:
    beside = path.with_name("accounts.jsonl.new")
    beside.mkdir()
    for number in range(3):
        file.save(Access((replace(ANA, since=float(number)),)))
        await file.look()
    failing = file.failing
    beside.rmdir()

    await file.look()

    assert (failing, file.failing) == (True, False)
    assert caplog.text.count("could not be written") == 1
    assert AccessFile(path).read()[0].accounts == (replace(ANA, since=2.0),)


async def test_a_change_of_the_console_waits_until_the_server_drops_it(
    path: Path, file: AccessFile
) -> None:
    change = AccessChange("account_role", ANA, {"role": "operator"})
    revoked = AccessChange("token_revoked", MES, gone=True)
    console = AccessFile(path)
    console.leave(change)
    console.leave(revoked)
    console.close()
    path.with_name("accounts.jsonl.left-junk").write_bytes(b"junk")

    left = file.left()
    await file.drop([path for path, _ in left])

    assert [one for _, one in left] == [change, revoked]
    assert file.left() == []
