"""The size of the history."""

import sqlite3
from pathlib import Path

import pytest

from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.recorder import Store
from iveg.adapters.history.upkeep import HistoryStats, TableStats, read_stats
from iveg.domain.records import Record
from iveg.vital.record import Waiting
from tests.fakes.records import NOON, climate_record, odometry_record

TEN_MINUTES: list[Record] = [
    *(
        odometry_record(robot_id=robot, at=NOON + n)
        for n in range(600)
        for robot in "AB"
    ),
    *(climate_record(at=NOON - 3600.0 + n * 60.0) for n in range(70)),
]


def measured(database_url: str) -> HistoryStats:
    engine = reading_engine(database_url)
    with engine.connect() as connection:
        found = read_stats(connection)
    engine.dispose()
    return found


def fill(database_url: str) -> None:
    store = Store(database_url)
    store.write([Waiting(one, n, 0.0) for n, one in enumerate(TEN_MINUTES)])
    store.close()


def of(found: HistoryStats, table: str) -> TableStats:
    return next(one for one in found.tables if one.name == table)


def test_each_table_is_counted_measured_and_aged(database_url: str) -> None:
    fill(database_url)

    found = measured(database_url)

    driven, air, nothing = (of(found, t) for t in ("odometry", "climate", "alerts"))
    # Two robots, in ten minutes and the one in which they began.
    assert found.robot_hours == pytest.approx(22 / 60)
    assert (driven.rows, driven.oldest, driven.newest) == (1200, NOON, NOON + 599.0)
    assert 50_000 < driven.size < 1_000_000
    assert driven.hourly == pytest.approx(driven.size / found.robot_hours)
    assert (nothing.rows, nothing.oldest, nothing.hourly) == (0, None, None)
    assert air.hourly is not None
    assert air.hourly == pytest.approx(air.size * 10 / 70 / found.robot_hours)
    assert found.tables[0] == max(found.tables, key=lambda one: one.size)


def test_where_sqlite_tells_no_sizes_rows_share_the_file(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'history.db'}"
    fill(url)
    # A table of that name hides SQLite's own, as a build without it does.
    other = sqlite3.connect(tmp_path / "history.db")
    other.execute("CREATE TABLE dbstat (a)")
    other.close()

    found = measured(url)

    total = sum(one.size for one in found.tables)
    assert total == pytest.approx((tmp_path / "history.db").stat().st_size, rel=0.01)
    assert of(found, "odometry").size == pytest.approx(total * 1200 / 1270, rel=0.01)
