"""The upkeep at work on a real history, on a disk that a test fills."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import text

from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder
from iveg.adapters.history.store import Store
from iveg.adapters.history.upkeep import RecordedHistory
from iveg.domain.disk_space import DiskSpace
from iveg.domain.records import Record
from iveg.domain.retention import DAY_S, SPARED_DAYS, Retention
from iveg.pipeline.audit import AuditTrail
from iveg.pipeline.record import Waiting
from iveg.pipeline.retention import HistoryUpkeep
from tests.builders import START
from tests.fakes.records import (
    alert_record,
    command_event_record,
    command_record,
    decision_record,
    log_record,
    odometry_record,
)
from tests.unit.pipeline.desk import Desk

DAYS, A_DAY = 10, 1000
KEPT = ("decisions", "commands", "alerts", "log", "command_events")


def _day(n: int) -> Iterator[Record]:
    """A day of telemetry, and a row of each kind that room never costs."""
    at = START.wall - n * DAY_S
    for k in range(A_DAY):
        yield odometry_record(at=at - k)
    yield decision_record(decision_id=f"D{n}", started_at=at, ended_at=at)
    yield command_record(command_id=f"C{n}", requested_at=at, state="RUNNING")
    yield command_event_record(command_id=f"C{n}", at=at)
    yield alert_record(alert_id=f"A{n}", last_raised_at=at, cleared_at=at)
    yield log_record(id=n, at=at)


def _count(url: str, table: str) -> int:
    engine = reading_engine(url)
    with engine.connect() as connection:
        found = connection.scalar(text(f"SELECT count(*) FROM {table}"))  # noqa: S608
    engine.dispose()
    return int(found or 0)


class _Disk:
    """A disk whose room a test sets."""

    space = DiskSpace(10**8, 10**12)

    def __call__(self, _: Path) -> DiskSpace:
        return self.space


@pytest.fixture
def url(tmp_path: Path) -> str:
    url = f"sqlite:///{tmp_path / 'history.db'}"
    store = Store(url)
    rows = [one for n in range(DAYS) for one in _day(n)]
    store.write([Waiting(one, n, 0.0) for n, one in enumerate(rows)])
    store.close()
    return url


async def test_a_full_disk_costs_the_oldest_telemetry_and_gets_its_room_back(
    url: str, tmp_path: Path
) -> None:
    desk, disk = Desk(), _Disk()
    recorder, queries = Recorder(url, tmp_path / "journal"), Queries(url)
    history = RecordedHistory(recorder, queries, tmp_path, read_space=disk)
    parts = desk.parts
    for_ever = Retention(0, 0, 0, 0)
    upkeep = HistoryUpkeep(
        history,
        for_ever,
        desk.event_log,
        parts.supervision,
        AuditTrail(desk.sink, desk.ids),
    )
    file = tmp_path / "history.db"
    size, left = file.stat().st_size, []

    for minute in range(DAYS):
        desk.clock.now = 60.0 * minute
        await upkeep.look(desk.clock())
        left.append(_count(url, "odometry"))
    room = await history.room_inside()
    disk.space = DiskSpace(10**10, 10**12)
    await upkeep.look(desk.clock())

    await recorder.close()
    queries.close()
    assert left[:3] == [9 * A_DAY, 8 * A_DAY, 7 * A_DAY]
    assert left[-1] == SPARED_DAYS * A_DAY
    assert {table: _count(url, table) for table in KEPT} == dict.fromkeys(KEPT, DAYS)
    assert room == 0
    assert file.stat().st_size < 0.7 * size
    assert [*parts.supervision.conditions(desk.clock())] == []
