"""What leaves the history when its time is over, and what never does."""

import asyncio
import contextlib
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from itertools import count
from pathlib import Path

import pytest
from alembic import command
from sqlalchemy import Engine, text

from iveg.adapters.history import listings
from iveg.adapters.history.ages import recorded_days
from iveg.adapters.history.engine import writing_engine
from iveg.adapters.history.lists import Filter
from iveg.adapters.history.migrate import alembic_config, upgrade
from iveg.adapters.history.places import people_seen
from iveg.adapters.history.purge import (
    BOUND_S,
    CHUNK,
    PurgeBatch,
    count_due,
    give_back,
    purge_batch,
    room_inside,
)
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder
from iveg.adapters.history.series import speed_series
from iveg.adapters.history.store import Store
from iveg.adapters.history.table_mappings import TABLE_MAPPINGS
from iveg.adapters.history.upkeep import RecordedHistory
from iveg.domain.errors import HopError
from iveg.domain.records import LatencyRecord, ReadingRecord, Record
from iveg.domain.retention import DAY_S, PURGE_STEPS, PurgeStep
from iveg.pipeline.record import Waiting
from tests.fakes.records import (
    NOON,
    alert_record,
    climate_record,
    command_event_record,
    command_record,
    decision_record,
    detection_record,
    log_record,
    measurement_record,
    odometry_record,
)

PLACE = {"x": 1.5, "y": -2.25}
OLD = NOON - 10 * DAY_S


def reading_record(at: float) -> ReadingRecord:
    return ReadingRecord(at=at, robot_id="AGI", kind="battery", value={"level": 0.5})


def everything(at: float, mark: str) -> list[Record]:
    """A row of each kind that is over, in each table that retention knows."""
    return [
        decision_record(
            decision_id=mark,
            started_at=at,
            ended_at=at + 1.0,
            rule_parameters={"radius_m": 2.0, "places": [{"robot_id": "AGI", **PLACE}]},
        ),
        detection_record(at=at),
        log_record(
            id=int(at), at=at, slots={"robot": "AGI", "confidence": 0.9, **PLACE}
        ),
        odometry_record(at=at),
        climate_record(at=at),
        reading_record(at),
        measurement_record(at=at),
        command_record(command_id=mark, requested_at=at, state="RUNNING"),
        alert_record(
            alert_id=mark, raised_at=at, last_raised_at=at, cleared_at=at + 1.0
        ),
        command_event_record(command_id=mark, at=at),
    ]


def write(database_url: str, records: Sequence[Record]) -> None:
    store = Store(database_url)
    store.write([Waiting(one, number, 0.0) for number, one in enumerate(records)])
    store.close()


@pytest.fixture
def engine(database_url: str) -> Iterator[Engine]:
    upgrade(database_url)
    engine = writing_engine(database_url)
    yield engine
    engine.dispose()


@pytest.fixture
def queries(database_url: str) -> Iterator[Queries]:
    queries = Queries(database_url)
    yield queries
    queries.close()


def still() -> float:
    """A stopwatch that stands: no batch reaches its bound."""
    return 0.0


def ticking(step_s: float) -> Callable[[], float]:
    """A stopwatch that moves with each look."""
    ticks = count()
    return lambda: next(ticks) * step_s


def run(
    engine: Engine,
    step: PurgeStep,
    before: float,
    stopwatch: Callable[[], float] = still,
) -> PurgeBatch:
    with engine.begin() as connection:
        return purge_batch(connection, step, before, stopwatch)


def rows(engine: Engine, table: str, what: str = "count(*)") -> object:
    with engine.begin() as connection:
        return connection.scalar(text(f"SELECT {what} FROM {table}"))  # noqa: S608


def test_every_table_is_kept_for_a_time_that_is_told() -> None:
    kept = {one.table.name for one in TABLE_MAPPINGS.values()}
    own = {TABLE_MAPPINGS[LatencyRecord].table.name}

    assert {
        step.table for step in PURGE_STEPS if step.kind != "positions"
    } == kept - own


def test_each_step_takes_what_is_older_and_nothing_of_that_moment_or_younger(
    engine: Engine, database_url: str
) -> None:
    ages = (OLD - 1.0, OLD, OLD + 1.0)
    write(
        database_url,
        [one for n, at in enumerate(ages) for one in everything(at, f"M{n}")],
    )

    # The audit goes by whole days (test_history_audit).
    steps = [one for one in PURGE_STEPS if one.table != "audit"]
    for step in steps:
        with engine.begin() as connection:
            due = count_due(connection, step, OLD)
        assert (due, run(engine, step, OLD)) == (1, PurgeBatch(1, is_last=True)), step
        assert run(engine, step, OLD) == PurgeBatch(0, is_last=True)

    assert {step.table: rows(engine, step.table) for step in steps} == (
        dict.fromkeys((step.table for step in steps), 2)
    )
    assert rows(engine, "detections", "count(x)") == 2


async def test_places_go_and_all_else_of_the_rows_stays(
    engine: Engine, database_url: str, queries: Queries
) -> None:
    write(database_url, everything(OLD - 1.0, "M"))
    [decided] = (await queries.page(listings.DECISIONS, Filter())).items
    [seen] = (await queries.page(listings.DETECTIONS, Filter())).items
    [told] = (await queries.page(listings.LOG, Filter())).items

    for step in PURGE_STEPS[:3]:
        run(engine, step, OLD)

    [decision] = (await queries.page(listings.DECISIONS, Filter())).items
    [detection] = (await queries.page(listings.DETECTIONS, Filter())).items
    [line] = (await queries.page(listings.LOG, Filter())).items
    assert (decision.x, decision.y, decision.z) == (None, None, None)
    assert decision.rule_parameters == {"radius_m": 2.0}
    assert (decision.distance_m, decision.links) == (decided.distance_m, decided.links)
    assert (detection.x, detection.y, detection.z, detection.box) == (None,) * 4
    assert (detection.class_id, detection.probability) == (
        seen.class_id,
        seen.probability,
    )
    assert line.slots == {"robot": "AGI", "confidence": 0.9}
    assert (line.key, line.at) == (told.key, told.at)
    assert await queries.ask(people_seen, 0.0, NOON) == ()


async def test_what_goes_on_and_drills_are_kept_whatever_their_age(
    engine: Engine, database_url: str
) -> None:
    write(
        database_url,
        [
            decision_record(started_at=OLD, ended_at=None),
            alert_record(raised_at=OLD, last_raised_at=OLD, cleared_at=None),
            command_record(command_id="held", requested_at=OLD, state="STANDING"),
            command_record(
                command_id="drill", requested_at=OLD, state="RUNNING", drill=True
            ),
        ],
    )

    for step in PURGE_STEPS:
        if step.kind == "decisions":
            assert run(engine, step, NOON).rows == 0


async def test_a_decision_that_is_written_again_loses_its_place_again(
    engine: Engine, database_url: str
) -> None:
    step = PurgeStep("positions", "decisions")
    write(database_url, [decision_record(started_at=OLD)])
    assert run(engine, step, NOON).rows == 1
    write(database_url, [decision_record(started_at=OLD, ended_at=NOON)])

    assert run(engine, step, NOON).rows == 1
    assert rows(engine, "decisions", "x") is None


@pytest.mark.parametrize("damaged", ['{"x": 1.0', '{"x": NaN, "y": 2.0}', '["x", "y"]'])
def test_a_damaged_row_does_not_hold_up_those_behind_it(
    tmp_path: Path, damaged: str
) -> None:
    url = f"sqlite:///{tmp_path / 'history.db'}"
    write(url, [log_record(id=n, at=OLD + n, slots=PLACE) for n in (1, 2)])
    engine = writing_engine(url)
    with engine.begin() as connection:
        spoil = text("UPDATE log SET slots = :slots WHERE id = 1")
        connection.execute(spoil, {"slots": damaged})

    done = run(engine, PurgeStep("positions", "log"), NOON)

    assert done.is_last
    assert rows(engine, "log", "min(instr(slots, '\"x\":'))") == 0
    assert rows(engine, "log", "max(instr(slots, '\"x\":'))") == 0
    engine.dispose()


@pytest.mark.parametrize(
    ("step_s", "statements"), [(BOUND_S, 1), (BOUND_S / 2, 2), (BOUND_S / 4, 4)]
)
def test_a_batch_ends_at_its_bound_and_says_that_more_is_left(
    engine: Engine, database_url: str, step_s: float, statements: int
) -> None:
    write(database_url, [odometry_record(at=OLD + n) for n in range(10 * CHUNK)])
    step = PurgeStep("telemetry", "odometry")

    batch = run(engine, step, NOON, ticking(step_s))

    assert batch == PurgeBatch(statements * CHUNK, is_last=False)
    assert rows(engine, "odometry", "min(at)") == OLD + statements * CHUNK


async def test_a_purge_beside_recording_loses_no_row_and_keeps_its_batches_small(
    database_url: str, tmp_path: Path, queries: Queries
) -> None:
    write(database_url, [odometry_record(at=OLD + n / 10) for n in range(3000)])
    recorder = Recorder(database_url, tmp_path / "journal")
    writing = asyncio.create_task(recorder.run())
    history = RecordedHistory(recorder, queries, tmp_path, ticking(2 * BOUND_S))
    batches, recorded, beside = 0, 0, 0

    while True:
        for _ in range(20):
            recorder.enqueue(odometry_record(at=NOON + recorded))
            recorded += 1
        batch = await history.purge(PurgeStep("telemetry", "odometry"), NOON)
        assert batch.rows <= CHUNK
        batches += 1
        if batch.is_last:
            break
        beside = recorder.counters["history_written"]

    writing.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await writing
    await recorder.close()
    (found,) = await queries.ask(speed_series, 0.0, NOON * 2)
    assert batches > 3000 / CHUNK
    assert beside > 0
    assert recorder.counters["history_written"] == recorded
    assert [*found.at] == [NOON + n for n in range(recorded)]


async def test_rows_that_wait_go_before_a_purge(tmp_path: Path) -> None:
    recorder = Recorder(f"sqlite:///{tmp_path / 'history.db'}", tmp_path / "journal")
    found = []

    for n in range(500):
        found.append(recorder.is_busy)
        recorder.enqueue(odometry_record(at=NOON + n))
    full = recorder.is_busy
    await recorder.close()

    assert (any(found), full, recorder.is_busy) == (False, True, False)


async def test_a_database_that_is_away_is_a_hop_and_no_error_of_ours(
    tmp_path: Path,
) -> None:
    url = f"sqlite:///{tmp_path / 'history.db'}?timeout=0.05"
    recorder, queries = Recorder(url, tmp_path / "journal"), Queries(url)
    upgrade(url)
    other = sqlite3.connect(tmp_path / "history.db", isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    history = RecordedHistory(recorder, queries, tmp_path)

    with pytest.raises(HopError, match="locked"):
        await history.purge(PURGE_STEPS[0], NOON)

    other.close()
    assert (await history.purge(PURGE_STEPS[0], NOON)).is_last
    assert (await history.disk_space()).total > 0
    await recorder.close()
    queries.close()


def test_an_sqlite_file_gives_its_free_pages_back(tmp_path: Path) -> None:
    file = tmp_path / "history.db"
    url = f"sqlite:///{file}"
    write(url, [odometry_record(at=OLD + n) for n in range(20_000)])
    engine = writing_engine(url)
    while not run(engine, PurgeStep("telemetry", "odometry"), NOON).is_last:
        pass
    with engine.begin() as connection:
        inside = room_inside(connection)
    assert inside > 10**6

    with engine.begin() as connection:
        batch = give_back(connection, ticking(BOUND_S / 4))
        left = room_inside(connection)
        again = give_back(connection, still)

    assert batch == PurgeBatch(3, is_last=False)
    assert left == inside - 3 * 4096
    assert again.is_last
    with engine.begin() as connection:
        assert room_inside(connection) == 0
    engine.dispose()
    assert file.stat().st_size < 10**6


def test_days_of_the_log_are_found_newest_first(
    database_url: str, queries: Queries
) -> None:
    at = [0.5, 0.9, 1.5, 7.2, 7.9, 4000.1]
    write(database_url, [log_record(id=n, at=day * DAY_S) for n, day in enumerate(at)])

    assert asyncio.run(queries.ask(recorded_days, 3)) == (4000, 7, 1)
    assert asyncio.run(queries.ask(recorded_days, 99)) == (4000, 7, 1, 0)


def test_the_way_back_to_the_version_before_and_forth_again_keeps_what_has_a_place(
    engine: Engine, database_url: str
) -> None:
    write(database_url, everything(OLD, "M1") + everything(NOON, "M2"))
    run(engine, PurgeStep("positions", "detections"), NOON)

    with engine.begin() as connection:
        command.downgrade(alembic_config(connection), "name_transport_and_limit")
    before = rows(engine, "detections"), rows(engine, "detections", "max(at)")
    upgrade(database_url)

    assert before == (1, NOON)
    write(database_url, [detection_record(at=NOON + 1.0)])
    assert rows(engine, "detections", "max(row_id)") == 3
