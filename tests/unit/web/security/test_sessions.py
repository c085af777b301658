"""Sessions outlive a restart of iVeg, and nothing kept lets another sign in."""

import hashlib
from collections.abc import Callable
from pathlib import Path

import pytest

from iveg.adapters.access_file import AccessFile, earlier_sessions
from iveg.adapters.files import Form, write_lines
from iveg.domain import accounts
from iveg.domain.accounts import Access, AccessBook
from iveg.web.security.sessions import Sessions
from tests.fakes.clock import FakeClock

HOUR = 3600.0
Restart = Callable[..., Sessions]


@pytest.fixture
def clock() -> FakeClock:
    return FakeClock()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "accounts.jsonl"


@pytest.fixture
def start(path: Path, clock: FakeClock) -> Restart:
    """The process before writes what waits, and the next one reads it."""
    files: list[AccessFile] = []

    def start() -> Sessions:
        if files:
            files.pop().close()
        files.append(file := AccessFile(path))
        book = AccessBook(file.load())
        book.on_keep.append(lambda: file.save(book.picture()))
        return Sessions(clock, book)

    return start


def test_the_file_holds_digests_alone_and_only_its_owner_reads_it(
    start: Restart, path: Path
) -> None:
    token = start().open("Ana", "operator")
    start()

    text = path.read_text()
    assert token not in text
    assert hashlib.sha256(token.encode()).hexdigest() in text
    assert path.stat().st_mode & 0o777 == 0o600


def test_f42_the_time_that_iveg_was_down_counts_and_stop_is_left_for_twelve_hours(
    start: Restart, clock: FakeClock
) -> None:
    token = start().open("Ana", "operator")

    clock.now += 13 * HOUR
    expired = start().find(token)
    clock.now += 12 * HOUR
    gone = start().find(token)

    assert expired is not None
    assert expired.may("stop")
    assert not expired.may("release")
    assert gone is None


def test_use_prolongs_no_session(clock: FakeClock) -> None:
    sessions = Sessions(clock, AccessBook())
    token = sessions.open("Ana", "operator")

    roles = []
    for _ in range(4):
        clock.now += 5 * HOUR
        found = sessions.find(token)
        assert found is not None
        roles.append(found.role)

    assert roles == ["operator"] * 2 + ["expired"] * 2


def test_sessions_are_bounded_and_the_oldest_gives_way(
    clock: FakeClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accounts, "MOST_SESSIONS", 2)
    sessions = Sessions(clock, AccessBook())
    tokens = []
    for name in ("a", "b", "c"):
        tokens.append(sessions.open(name, "viewer"))
        clock.now += 1

    assert [sessions.find(token) is None for token in tokens] == [True, False, False]


def test_a_viewer_stays_for_thirty_days_unused_and_may_then_stop(
    start: Restart, clock: FakeClock
) -> None:
    sessions = start()
    token = sessions.open("Wall", "viewer")

    found = []
    for days in (29, 1.4, 0.5):
        clock.now += days * 24 * HOUR
        found.append(sessions.find(token))

    assert [one and one.role for one in found] == ["viewer", "expired", None]


def test_a_clock_that_was_ahead_makes_no_session_that_never_ends(
    start: Restart, clock: FakeClock
) -> None:
    clock.now = 10 * 365 * 24 * HOUR
    token = start().open("Ana", "operator")
    clock.now = 0.0
    sessions = start()

    clock.now += 37 * HOUR

    assert sessions.find(token) is None


def test_sessions_of_earlier_versions_stay(tmp_path: Path, clock: FakeClock) -> None:
    now, before = clock().wall, tmp_path / "sessions.jsonl"
    kept = {
        "digest": hashlib.sha256(b"token").hexdigest(),
        "name": "Nave 2",
        "role": "viewer",
        "method": "tablet",
        "holder": "P1",
        "began": now,
        "seen": now,
    }
    write_lines(before, Form("sessions"), [kept])

    book = AccessBook(Access(sessions=earlier_sessions(before)))
    found = Sessions(clock, book).find("token")

    assert found is not None
    assert (found.name, found.role, found.method) == ("Nave 2", "viewer", "link")
