"""What leaves the history when its time is over, and what never does."""

import asyncio
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import Engine, text

from iveg.adapters.history import lists, upkeep
from iveg.adapters.history.engine import upgrade, writing_engine
from iveg.adapters.history.lists import Filter
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.series import people_seen
from iveg.adapters.history.tables import TABLE_MAPPINGS
from iveg.adapters.history.upkeep import purge_piece, recorded_days
from iveg.domain.records import ReadingRecord, Record
from iveg.domain.retention import DAY_S, PURGE_STEPS, PurgeStep
from tests.databases import remember
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


@pytest.fixture
def engine(database_url: str) -> Iterator[Engine]:
    upgrade(database_url)
    engine = writing_engine(database_url)
    yield engine
    engine.dispose()


def run(engine: Engine, step: PurgeStep, before: float) -> int:
    with engine.begin() as connection:
        return purge_piece(connection, step, before)


def rows(engine: Engine, table: str, what: str = "count(*)") -> object:
    with engine.begin() as connection:
        return connection.scalar(text(f"SELECT {what} FROM {table}"))  # noqa: S608


def test_every_table_is_kept_for_a_time_that_is_told() -> None:
    kept = {one.table.name for one in TABLE_MAPPINGS.values()}

    assert {step.table for step in PURGE_STEPS if step.kind != "positions"} == kept


def test_each_step_takes_what_is_older_and_nothing_of_that_moment_or_younger(
    engine: Engine, database_url: str
) -> None:
    for mark, at in enumerate((OLD - 1.0, OLD, OLD + 1.0)):
        remember(database_url, *everything(at, f"M{mark}"))

    # Of the audit: test_history_audit.
    steps = [one for one in PURGE_STEPS if one.table != "audit"]
    for step in steps:
        assert run(engine, step, OLD) == 1, step
        assert run(engine, step, OLD) == 0

    assert {rows(engine, step.table) for step in steps} == {2}
    assert rows(engine, "detections", "count(x)") == 2


async def test_places_go_and_all_else_of_the_rows_stays(
    engine: Engine, database_url: str, queries: Queries
) -> None:
    remember(database_url, *everything(OLD - 1.0, "M"))
    [decided] = (await queries.page(lists.DECISIONS, Filter())).items
    [seen] = (await queries.page(lists.DETECTIONS, Filter())).items
    [told] = (await queries.page(lists.LOG, Filter())).items

    for step in PURGE_STEPS[:3]:
        run(engine, step, OLD)

    [decision] = (await queries.page(lists.DECISIONS, Filter())).items
    [detection] = (await queries.page(lists.DETECTIONS, Filter())).items
    [line] = (await queries.page(lists.LOG, Filter())).items
    assert decision == replace(
        decided, x=None, y=None, z=None, rule_parameters={"radius_m": 2.0}
    )
    assert detection == replace(seen, x=None, y=None, z=None, box=None)
    assert line == replace(told, slots={"robot": "AGI", "confidence": 0.9})
    assert await queries.ask(people_seen, 0.0, NOON) == ()


async def test_what_goes_on_is_kept_whatever_their_age(
    engine: Engine, database_url: str
) -> None:
    remember(
        database_url,
        decision_record(started_at=OLD, ended_at=None),
        alert_record(raised_at=OLD, last_raised_at=OLD, cleared_at=None),
        command_record(command_id="held", requested_at=OLD, state="STANDING"),
    )

    for step in PURGE_STEPS:
        if step.kind == "decisions":
            assert run(engine, step, NOON) == 0


async def test_a_decision_that_is_written_again_loses_its_place_again(
    engine: Engine, database_url: str
) -> None:
    step = PurgeStep("positions", "decisions")
    remember(database_url, decision_record(started_at=OLD))
    assert run(engine, step, NOON) == 1
    remember(database_url, decision_record(started_at=OLD, ended_at=NOON))

    assert run(engine, step, NOON) == 1
    assert rows(engine, "decisions", "x") is None


@pytest.mark.parametrize("damaged", ['{"x": 1.0', '{"x": NaN, "y": 2.0}', '["x", "y"]'])
def test_a_damaged_row_does_not_hold_up_those_behind_it(
    tmp_path: Path, damaged: str
) -> None:
    url = f"sqlite:///{tmp_path / 'history.db'}"
    remember(url, *[log_record(id=n, at=OLD + n, slots=PLACE) for n in (1, 2)])
    engine = writing_engine(url)
    with engine.begin() as connection:
        spoil = text("UPDATE log SET slots = :slots WHERE id = 1")
        connection.execute(spoil, {"slots": damaged})

    run(engine, PurgeStep("positions", "log"), NOON)

    assert run(engine, PurgeStep("positions", "log"), NOON) == 0
    assert rows(engine, "log", "min(instr(slots, '\"x\":'))") == 0
    assert rows(engine, "log", "max(instr(slots, '\"x\":'))") == 0
    engine.dispose()


def test_a_piece_takes_the_oldest_and_whole_moments(
    engine: Engine, database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(upkeep, "PIECE", 3)
    times = (0.0, 1.0, 2.0, 2.0, 3.0, 4.0)
    remember(database_url, *[odometry_record(at=OLD + after) for after in times])

    took = [run(engine, PurgeStep("telemetry", "odometry"), NOON) for _ in range(3)]

    assert took == [4, 2, 0]


def test_days_of_the_log_are_found_newest_first(
    database_url: str, queries: Queries
) -> None:
    at = [0.5, 0.9, 1.5, 7.2, 7.9, 4000.1]
    remember(
        database_url, *[log_record(id=n, at=day * DAY_S) for n, day in enumerate(at)]
    )

    assert asyncio.run(queries.ask(recorded_days, 3)) == (4000, 7, 1)
    assert asyncio.run(queries.ask(recorded_days, 99)) == (4000, 7, 1, 0)
