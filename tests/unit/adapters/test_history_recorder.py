import asyncio
import contextlib
import os
import sqlite3
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from sqlalchemy import text

from iveg.adapters.history.engine import reading_engine, upgrade
from iveg.adapters.history.recorder import Recorder
from iveg.adapters.journal import FileJournal
from iveg.domain.observations import Instant
from iveg.domain.records import Record
from tests.fakes.postgresql import PostgreSQL
from tests.fakes.records import (
    NOON,
    alert_record,
    audit_record,
    command_event_record,
    command_record,
    decision_record,
    detection_record,
    log_record,
    odometry_record,
)
from tests.patience import PATIENCE_S, until

EVERYTHING: dict[str, Record] = {
    "alerts": alert_record(),
    "audit": audit_record(),
    "command_events": command_event_record(),
    "commands": command_record(),
    "decisions": decision_record(),
    "detections": detection_record(),
    "log": log_record(),
    "odometry": odometry_record(),
}


@asynccontextmanager
async def recording(
    database_url: str, directory: Path, capacity: int = 20_000
) -> AsyncIterator[Recorder]:
    journal = FileJournal(directory / "commands.jsonl")
    journal.read()
    recorder = Recorder(database_url, journal, capacity=capacity)
    task = asyncio.create_task(recorder.run())
    try:
        yield recorder
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        await recorder.close()
        journal.close()


def state(recorder: Recorder) -> str:
    return recorder.state()


def scalar(database_url: str, query: str) -> object:
    engine = reading_engine(database_url)
    with engine.connect() as connection:
        found = connection.scalar(text(query))
    engine.dispose()
    return found


def count(database_url: str, table: str) -> object:
    return scalar(database_url, f"SELECT count(*) FROM {table}")  # noqa: S608


def counts(database_url: str) -> dict[str, object]:
    return {table: count(database_url, table) for table in EVERYTHING}


def moved_aside(directory: Path) -> list[Path]:
    return list(directory.glob("history.db.corrupt-*"))


def left(directory: Path) -> list[Record]:
    """Rows that the journal keeps for the next run."""
    journal = FileJournal(directory / "commands.jsonl")
    journal.read()
    journal.close()
    return [one.record for one in journal.left()]


def lock(database_url: str) -> sqlite3.Connection:
    """Somebody else's program that holds the database."""
    file = database_url.removeprefix("sqlite:///").partition("?")[0]
    connection = sqlite3.connect(file, isolation_level=None)
    connection.execute("BEGIN EXCLUSIVE")
    return connection


async def test_everything_that_is_offered_is_stored(
    database_url: str, tmp_path: Path
) -> None:
    async with recording(database_url, tmp_path) as recorder:
        for record in EVERYTHING.values():
            recorder.enqueue(record)
        await until(lambda: recorder.counters["history_written"] == len(EVERYTHING))
        assert state(recorder) == "ok"

    assert set(counts(database_url).values()) == {1}


async def test_while_the_database_is_locked_only_the_oldest_telemetry_is_lost(
    sqlite_url: str, tmp_path: Path
) -> None:
    upgrade(sqlite_url)
    other = lock(sqlite_url)
    url = f"{sqlite_url}?timeout=0.2"
    async with recording(url, tmp_path, 10) as recorder:
        for record in EVERYTHING.values():
            recorder.enqueue(record)
        for number in range(100):
            recorder.enqueue(odometry_record(at=NOON + number))
        await until(lambda: state(recorder) == "down")
        await until(lambda: recorder.counters["history_waiting"] == 10)

        other.close()
        await until(lambda: state(recorder) == "ok")
        await until(lambda: recorder.counters["history_waiting"] == 0)

    stored = counts(sqlite_url)
    assert stored.pop("odometry") == 4
    assert stored.pop("detections") == 0
    assert set(stored.values()) == {1}
    assert recorder.counters["history_dropped"] == 98
    assert moved_aside(tmp_path) == []


async def test_a_server_that_dies_is_missed_and_welcomed_back(
    postgresql: PostgreSQL, postgresql_url: str, tmp_path: Path
) -> None:
    async with recording(postgresql_url, tmp_path) as recorder:
        recorder.enqueue(command_record(state="REQUESTED"))
        await until(lambda: recorder.counters["history_written"] == 1)
        postgresql.stop()
        recorder.enqueue(command_record(state="STANDING"))
        recorder.enqueue(odometry_record())
        await until(lambda: state(recorder) == "down")

        postgresql.start()
        await until(lambda: state(recorder) == "ok")
        await until(lambda: recorder.counters["history_waiting"] == 0)

    assert scalar(postgresql_url, "SELECT state FROM commands") == "STANDING"
    assert count(postgresql_url, "odometry") == 1


async def test_what_a_crash_left_is_stored_at_the_next_start_and_never_again(
    database_url: str, tmp_path: Path
) -> None:
    path = tmp_path / "commands.jsonl"
    rows = command_record(state="REQUESTED"), command_event_record()
    crashed = Recorder(database_url, FileJournal(path))
    for record in rows:
        crashed.enqueue(record)
    await crashed.flushed()
    old = path.read_bytes()

    async with recording(database_url, tmp_path) as recorder:
        await asyncio.wait_for(recorder.caught_up.wait(), PATIENCE_S)
        state_then = scalar(database_url, "SELECT state FROM commands")
        recorder.enqueue(command_record(state="STANDING"))
    path.write_bytes(old)
    async with recording(database_url, tmp_path) as recorder:
        await asyncio.wait_for(recorder.caught_up.wait(), PATIENCE_S)

    assert state_then == "REQUESTED"
    assert scalar(database_url, "SELECT state FROM commands") == "STANDING"
    assert count(database_url, "command_events") == 1


async def test_the_journal_lets_go_of_what_the_database_has(
    database_url: str, tmp_path: Path
) -> None:
    journal = FileJournal(tmp_path / "commands.jsonl")
    recorder = Recorder(database_url, journal)
    recorder.enqueue(command_record())
    await recorder.flushed()
    before = len(journal.left())

    await recorder.close()

    assert (before, len(journal.left())) == (1, 0)
    journal.close()


async def test_closing_while_the_database_is_away_leaves_orders_to_the_journal(
    sqlite_url: str, tmp_path: Path
) -> None:
    upgrade(sqlite_url)
    other = lock(sqlite_url)
    journal = FileJournal(tmp_path / "commands.jsonl")
    recorder = Recorder(f"{sqlite_url}?timeout=0.1", journal)
    for record in EVERYTHING.values():
        recorder.enqueue(record)

    await recorder.close()
    journal.close()
    other.close()

    orders = [command_event_record(), command_record()]
    assert left(tmp_path) == orders
    assert recorder.counters["history_dropped"] == len(EVERYTHING) - len(orders)


async def test_a_bad_row_holds_up_no_rows_of_other_kinds(
    database_url: str, tmp_path: Path
) -> None:
    async with recording(database_url, tmp_path) as recorder:
        recorder.enqueue(odometry_record(x=None))
        recorder.enqueue(log_record(id=2**70))
        recorder.enqueue(log_record(id=2))
        recorder.enqueue(command_record())
        await until(lambda: recorder.counters["history_written"] == 4)
        await until(lambda: state(recorder) == "ok")

    assert recorder.counters["history_rejected"] == 3
    assert count(database_url, "odometry") == 0
    assert count(database_url, "commands") == 1


async def test_a_file_that_rots_while_in_use_is_moved_aside(
    sqlite_url: str, tmp_path: Path
) -> None:
    file = tmp_path / "history.db"
    recorder = Recorder(sqlite_url, FileJournal(tmp_path / "journal"))
    task = asyncio.create_task(recorder.run())
    recorder.enqueue(command_record())
    await until(lambda: recorder.counters["history_written"] == 1)
    with file.open("r+b") as raw:
        raw.write(os.urandom(100))

    recorder.enqueue(command_record(command_id="C2"))
    await until(lambda: recorder.counters["history_written"] == 2)
    task.cancel()
    await asyncio.wait({task})
    await recorder.close()

    assert len(moved_aside(tmp_path)) == 1
    assert scalar(sqlite_url, "SELECT command_id FROM commands") == "C2"


async def test_what_waits_too_long_is_late(sqlite_url: str, tmp_path: Path) -> None:
    moments = [Instant(at, NOON) for at in (100.0, 101.0, 103.0, 103.0)]
    recorder = Recorder(
        sqlite_url,
        FileJournal(tmp_path / "journal"),
        read_clock=iter(moments).__next__,
    )
    recorder.enqueue(odometry_record())

    states = [recorder.state(), recorder.state()]
    await recorder.close()

    assert states == ["ok", "late"]
    assert recorder.state() == "ok"


async def test_what_the_disk_did_not_take_waits_for_the_database(
    sqlite_url: str, tmp_path: Path
) -> None:
    (tmp_path / "journal").mkdir()
    recorder = Recorder(sqlite_url, FileJournal(tmp_path / "journal"))

    recorder.enqueue(command_record())
    await recorder.flushed()

    (tmp_path / "journal").rmdir()
    await recorder.close()
    assert count(sqlite_url, "commands") == 1
