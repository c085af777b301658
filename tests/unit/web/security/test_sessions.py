"""Sessions outlive a restart of iVeg, and nothing kept lets another sign in."""

import hashlib
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from iveg.adapters.files import write_lines
from iveg.adapters.sessions import FORM, FileSessions, Session
from iveg.web.security.roles import Principal
from iveg.web.security.sessions import Sessions
from tests.fakes.clock import FakeClock

HOUR = 3600.0


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "sessions.jsonl"


@pytest.fixture
def clock() -> FakeClock:
    return FakeClock()


@pytest.fixture
def store(path: Path) -> Iterator[FileSessions]:
    store = FileSessions(path)
    yield store
    store.close()


def restarted(path: Path, clock: FakeClock, most: int = 1000) -> Sessions:
    """What the next process knows."""
    return Sessions(clock, FileSessions(path), most)


def test_a_session_outlives_a_restart_with_name_and_role(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    token = Sessions(clock, store).open("Ana", "viewer")
    store.close()
    clock.now += 60.0

    found = restarted(path, clock).find(token)

    assert found is not None
    assert (found.name, found.role) == ("Ana", "viewer")


def test_the_file_holds_digests_alone_and_only_its_owner_reads_it(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    token = Sessions(clock, store).open("Ana", "operator")
    store.close()

    text = path.read_text()
    assert token not in text
    assert hashlib.sha256(token.encode()).hexdigest() in text
    assert path.stat().st_mode & 0o777 == 0o600


def test_who_signed_out_is_not_back_after_a_restart(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    sessions = Sessions(clock, store)
    token = sessions.open("Ana", "operator")
    who = sessions.find(token)
    assert who is not None

    sessions.revoke(who)
    store.close()

    assert restarted(path, clock).find(token) is None


def test_f42_the_time_that_iveg_was_down_counts_and_stop_is_left_for_twelve_hours(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    token = Sessions(clock, store).open("Ana", "operator")
    store.close()

    clock.now += 13 * HOUR
    expired = restarted(path, clock).find(token)
    clock.now += 12 * HOUR
    gone = restarted(path, clock).find(token)

    assert expired is not None
    assert expired.may("stop")
    assert not expired.may("release")
    assert gone is None


def test_a_sign_of_life_is_kept_within_a_minute(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    sessions = Sessions(clock, store)
    token = sessions.open("Ana", "operator")
    clock.now += 11 * HOUR
    sessions.find(token)
    store.close()
    clock.now += 2 * HOUR

    found = restarted(path, clock).find(token)

    assert found is not None
    assert found.role == "operator"


def test_a_clock_that_was_ahead_makes_no_session_that_never_ends(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    clock.now = 10 * 365 * 24 * HOUR
    token = Sessions(clock, store).open("Ana", "operator")
    store.close()
    clock.now = 0.0
    sessions = restarted(path, clock)

    clock.now += 37 * HOUR

    assert sessions.find(token) is None


def test_of_too_many_sessions_the_newest_are_remembered(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    sessions = Sessions(clock, store)
    tokens = []
    for _ in range(3):
        clock.now += 1.0
        tokens.append(sessions.open("Ana", "operator"))
    store.close()

    remembered = restarted(path, clock, most=2)

    assert [remembered.find(token) is not None for token in tokens] == [
        False,
        True,
        True,
    ]


@pytest.mark.parametrize(
    "line",
    [
        b"{",
        b"[]",
        b'{"digest": "ab", "name": "a", "role": "admin", "began": 1.0, "seen": 1.0}',
        b'{"digest": "%s", "name": 1, "role": "admin", "began": 1.0, "seen": 1.0}'
        % (b"ab" * 32),
        b'{"digest": "%s", "name": "a", "role": "admin", "began": "x", "seen": 1.0}'
        % (b"ab" * 32),
        b"\xff\xfe",
    ],
)
def test_a_line_that_cannot_be_read_is_nobodys_session(
    path: Path, clock: FakeClock, line: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    path.write_bytes(line + b"\n")

    assert len(restarted(path, clock)) == 0
    assert "line 1: not readable" in caplog.text


@pytest.mark.parametrize("role", ["program", "expired", "root"])
def test_a_role_that_nobody_signs_in_with_is_not_remembered(
    path: Path, clock: FakeClock, store: FileSessions, role: str
) -> None:
    now = clock().wall
    store.save([Session("ab" * 32, "Ana", role, now, now)])
    store.close()

    assert len(restarted(path, clock)) == 0


def test_a_disk_that_fails_is_told_once_and_signs_nobody_out(
    tmp_path: Path, clock: FakeClock, caplog: pytest.LogCaptureFixture
) -> None:
    store = FileSessions(tmp_path / "missing" / "sessions.jsonl")
    sessions = Sessions(clock, store)

    tokens = []
    for _ in range(3):
        tokens.append(sessions.open("Ana", "operator"))
        store.close()

    assert all(sessions.find(token) is not None for token in tokens)
    assert caplog.text.count("could not be written") == 1


def test_a_session_that_was_lowered_is_a_viewers_and_stays_one(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    sessions = Sessions(clock, store)
    token, other = sessions.open("Ana", "operator"), sessions.open("Eva", "operator")
    before = sessions.find(token)
    assert before is not None

    sessions.lower(before)
    sessions.lower(Principal("program", "program"))
    store.close()

    assert sessions.current(before) == replace(before, role="viewer", wall=True)
    again = restarted(path, clock)
    found = [one for token in (token, other) if (one := again.find(token))]
    assert [(one.role, one.wall) for one in found] == [
        ("viewer", True),
        ("operator", False),
    ]


def test_sessions_of_earlier_versions_stay_and_get_the_name_of_the_links_person(
    path: Path, clock: FakeClock
) -> None:
    now = clock().wall
    before = [Session("", "operator", "operator", now, now)]
    before.append(Session("", "Eva", "viewer", now, now))
    lines = []
    for number, one in enumerate(before):
        digest = hashlib.sha256(f"token-{number}".encode()).hexdigest()
        line = {**asdict(one), "digest": digest}
        del line["person"], line["method"]
        lines.append(line)
    write_lines(path, FORM, lines)

    sessions = Sessions(clock, FileSessions(path), link_name="Ana")

    found = [sessions.find(f"token-{number}") for number in range(2)]
    told = [(one.name, one.role, one.person) for one in found if one is not None]
    assert told == [("Ana", "operator", "link"), ("Eva", "viewer", "")]


def test_a_new_name_of_the_link_is_that_of_its_sessions_after_a_restart(
    path: Path, clock: FakeClock, store: FileSessions
) -> None:
    token = Sessions(clock, store, link_name="Ana").open_by_link()
    store.close()

    found = Sessions(clock, FileSessions(path), link_name="Eva").find(token)

    assert found is not None
    assert (found.name, found.person) == ("Eva", "link")
