"""Telemetry of a day is a table of its own on PostgreSQL, and goes as one."""

from collections.abc import Iterator, Sequence

import pytest
from alembic import command
from sqlalchemy import Engine, text
from sqlalchemy.exc import OperationalError

from iveg.adapters import clock
from iveg.adapters.history.ages import oldest_telemetry
from iveg.adapters.history.day_partitions import (
    AHEAD_DAYS,
    PARTITIONED,
    days_of,
    drop_day,
    prepare_days,
)
from iveg.adapters.history.engine import writing_engine
from iveg.adapters.history.migrate import alembic_config, upgrade
from iveg.adapters.history.purge import PurgeBatch, count_due, purge_batch
from iveg.adapters.history.stats import read_stats
from iveg.adapters.history.store import Store
from iveg.domain.records import Record
from iveg.domain.retention import DAY_S, PurgeStep
from iveg.pipeline.record import Waiting
from tests.fakes.records import NOON, detection_record, odometry_record

ODOMETRY = PurgeStep("telemetry", "odometry")


def today() -> int:
    """Asked anew each time: the suite may run through midnight."""
    return int(clock.wall() // DAY_S)


@pytest.fixture
def engine(postgresql_url: str) -> Iterator[Engine]:
    upgrade(postgresql_url)
    engine = writing_engine(postgresql_url)
    yield engine
    engine.dispose()


def prepare(engine: Engine, day: int) -> None:
    with engine.begin() as connection:
        prepare_days(connection, day * DAY_S + 1.0)


def days(engine: Engine, table: str = "odometry") -> Sequence[int]:
    with engine.connect() as connection:
        return days_of(connection, table)


def write(engine: Engine, *records: Record) -> None:
    store = Store(engine.url.render_as_string(hide_password=False))
    store.write([Waiting(one, n, 0.0) for n, one in enumerate(records)])
    store.close()


def count(engine: Engine, table: str) -> int:
    with engine.connect() as connection:
        statement = text(f"SELECT count(*) FROM {table}")  # noqa: S608
        return int(connection.scalar(statement) or 0)


def purge(engine: Engine, before: float) -> list[PurgeBatch]:
    found: list[PurgeBatch] = []
    while not found or not found[-1].is_last:
        with engine.begin() as connection:
            found.append(purge_batch(connection, ODOMETRY, before, clock.mono))
    return found


def test_tables_of_days_are_made_ahead_and_once(engine: Engine) -> None:
    prepare(engine, today())
    prepare(engine, today())
    prepare(engine, today() + 1)

    assert [*days(engine)] == [*range(today(), today() + AHEAD_DAYS + 2)]
    assert days(engine, "detections") == days(engine)
    assert days(engine, "climate") == ()


def test_what_is_over_goes_as_whole_days_and_the_day_of_the_horizon_stays(
    engine: Engine,
) -> None:
    prepare(engine, today())
    noons = [(today() + n + 0.5) * DAY_S for n in range(3)]
    write(engine, *(odometry_record(at=at + n) for at in noons for n in range(120)))
    before = noons[2]

    with engine.connect() as connection:
        due = count_due(connection, ODOMETRY, before)
    batches = purge(engine, before)

    assert (due, sum(one.rows for one in batches)) == (240, 240)
    # A day is one batch, which no bound of rows cuts.
    assert [one.rows for one in batches] == [120, 120, 0]
    assert count(engine, "odometry") == 120
    assert days(engine)[0] == today() + 2


def test_rows_of_before_go_one_by_one_up_to_the_very_moment(engine: Engine) -> None:
    write(engine, *(odometry_record(at=NOON + n) for n in range(4)))

    assert sum(one.rows for one in purge(engine, NOON + 2.0)) == 2
    assert count(engine, "odometry") == 2


def test_a_row_of_a_day_without_a_table_is_kept_and_gets_it_later(
    engine: Engine,
) -> None:
    ahead = today() + 100
    write(engine, odometry_record(at=ahead * DAY_S + 5.0))
    assert count(engine, "odometry_rest") == 1

    prepare(engine, ahead + 30)

    assert (count(engine, "odometry_rest"), count(engine, "odometry")) == (0, 1)
    assert ahead in days(engine)


def test_a_day_that_somebody_reads_is_dropped_another_time(engine: Engine) -> None:
    prepare(engine, today())
    with engine.connect() as reader, reader.begin():
        assert oldest_telemetry(reader) is None
        with pytest.raises(OperationalError, match="lock"), engine.begin() as writer:
            drop_day(writer, "odometry", (today() + 2) * DAY_S)

    assert days(engine)[0] == today()
    with engine.begin() as connection:
        assert drop_day(connection, "odometry", (today() + 2) * DAY_S) == 0


def test_a_history_of_before_keeps_every_row_there_and_back(engine: Engine) -> None:
    with engine.begin() as connection:
        command.downgrade(alembic_config(connection), "end_api_tokens")
        for at in (NOON, today() * DAY_S + 1.0, (today() + 300) * DAY_S):
            connection.execute(
                text(
                    "INSERT INTO odometry (at, robot_id, x, y, yaw, linear, angular, "
                    "limit_factor) VALUES (:at, 'AGI', 1, 2, 0, 0.5, 0, 1)"
                ),
                {"at": at},
            )
    upgrade(engine.url.render_as_string(hide_password=False))
    write(engine, odometry_record(at=NOON + 1.0), detection_record(at=NOON))
    # Today has rows in the table of before: the first with its own is tomorrow.
    prepare(engine, today())

    first = days(engine)[0], days(engine, "detections")[0]
    with engine.begin() as connection:
        found = connection.scalars(text("SELECT row_id FROM odometry ORDER BY 1"))
        numbers = [*found]
        command.downgrade(alembic_config(connection), "end_api_tokens")
    assert numbers == [1, 2, 3, 4]
    assert first == (today() + 1, today())
    assert (count(engine, "odometry"), count(engine, "detections")) == (4, 1)


def test_sizes_count_every_day(engine: Engine) -> None:
    prepare(engine, today())
    write(engine, *(odometry_record(at=today() * DAY_S + n) for n in range(2000)))

    with engine.connect() as connection:
        found = {one.name: one for one in read_stats(connection).tables}

    assert found["odometry"].size > 2000 * 100
    assert found["odometry"].days == AHEAD_DAYS + 1
    assert {name for name, one in found.items() if one.days} == {*PARTITIONED}


def test_charts_of_a_day_read_its_index_alone(engine: Engine) -> None:
    prepare(engine, today())
    write(engine, *(odometry_record(at=today() * DAY_S + n) for n in range(500)))

    with engine.connect() as connection:
        connection.execute(text("SET enable_seqscan = off"))
        connection.execute(text("SET enable_bitmapscan = off"))
        plan = connection.scalars(
            text(
                "EXPLAIN SELECT avg(linear), min(limit_factor), min(applied_factor), "
                "min(margin_m) FROM odometry WHERE robot_id = 'AGI' "
                "AND at >= :since AND at < :until"
            ),
            {"since": today() * DAY_S, "until": (today() + 1) * DAY_S},
        )
        told = "\n".join(plan)

    assert "Index Only Scan" in told
    # Of one day's table: no other is looked at.
    assert told.count(" on odometry") == 1
