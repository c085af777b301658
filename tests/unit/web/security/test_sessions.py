"""Sessions outlive a restart of iVeg, and nothing kept lets another sign in."""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from iveg.adapters.access_file import AccessFile
from iveg.domain import accounts
from iveg.domain.accounts import AccessBook
from iveg.web.security.roles import Principal, Role
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


@pytest.mark.parametrize(
    ("role", "after_h", "left"),
    [
        # Used, but not beyond a day.
        ("operator", [5] * 6, ["operator"] * 4 + ["expired"] * 2),
        # Unused for thirty days.
        ("viewer", [29 * 24, 34, 12], ["viewer", "expired", None]),
    ],
)
def test_a_session_is_alive_for_as_long_as_its_role_says_and_may_then_stop(
    clock: FakeClock, role: Role, after_h: list[int], left: list[Role | None]
) -> None:
    sessions = Sessions(clock, AccessBook())
    token = sessions.open("Ana", role)

    found = []
    for hours in after_h:
        clock.now += hours * HOUR
        found.append(sessions.find(token))

    assert [one and one.role for one in found] == left


def test_watching_alone_does_not_keep_a_session_alive(clock: FakeClock) -> None:
    sessions = Sessions(clock, AccessBook())
    principal = sessions.find(sessions.open("Ana", "operator"))
    assert principal is not None

    left = []
    for hours in (11, 2):
        clock.now += hours * HOUR
        left.append(sessions.current(principal))

    assert [one and one.role for one in left] == ["operator", "expired"]


def test_sessions_are_bounded_and_the_longest_idle_gives_way(
    clock: FakeClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accounts, "MOST_SESSIONS", 2)
    sessions = Sessions(clock, AccessBook())
    first, second = sessions.open("a", "viewer"), sessions.open("b", "viewer")
    clock.now += 1
    sessions.find(first)

    third = sessions.open("c", "viewer")

    there = [sessions.find(token) is not None for token in (first, second, third)]
    assert there == [True, False, True]


def test_a_sign_of_life_is_kept_within_a_minute(
    start: Restart, clock: FakeClock
) -> None:
    sessions = start()
    token = sessions.open("Ana", "operator")
    clock.now += 11 * HOUR
    sessions.find(token)
    clock.now += 2 * HOUR

    found = start().find(token)

    assert found is not None
    assert found.role == "operator"


def test_a_clock_that_was_ahead_makes_no_session_that_never_ends(
    start: Restart, clock: FakeClock
) -> None:
    clock.now = 10 * 365 * 24 * HOUR
    token = start().open("Ana", "operator")
    clock.now = 0.0
    sessions = start()

    clock.now += 37 * HOUR

    assert sessions.find(token) is None


def test_a_session_that_was_lowered_is_a_viewers_and_stays_one(start: Restart) -> None:
    sessions = start()
    token, other = sessions.open("Ana", "operator"), sessions.open("Eva", "operator")
    before = sessions.find(token)
    assert before is not None

    sessions.lower(before)
    sessions.lower(Principal("program", "program"))

    assert sessions.current(before) == replace(before, role="viewer", wall=True)
    again = start()
    found = [one for token in (token, other) if (one := again.find(token))]
    assert [(one.role, one.wall) for one in found] == [
        ("viewer", True),
        ("operator", False),
    ]
