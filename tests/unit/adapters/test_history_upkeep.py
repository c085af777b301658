"""The upkeep of the history: when it works, when it gives way, what it tells."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from iveg.adapters.history import upkeep
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder
from iveg.adapters.history.upkeep import SETTLES_S, DiskWatch, HistoryUpkeep
from iveg.adapters.journal import FileJournal
from iveg.domain.errors import HopError
from iveg.domain.records import AuditRecord, LogRecord
from iveg.domain.retention import DAY_S, DiskSpace, Retention
from iveg.vital.audit import AuditTrail
from tests.builders import START
from tests.databases import remember
from tests.fakes.records import detection_record, log_record, odometry_record
from tests.unit.vital.desk import Desk

ROOMY, LOW, ALMOST = (DiskSpace(n * 10**8, 10**12) for n in (50, 9, 11))
NOW = START.wall + SETTLES_S


class Upkeep:
    """An upkeep on a clock that is moved by hand."""

    def __init__(self, directory: Path) -> None:
        self.desk = Desk()
        url = f"sqlite:///{directory / 'history.db'}"
        self.file = directory / "history.db"
        self.recorder = Recorder(url, FileJournal(directory / "journal"))
        self.queries = Queries(url)
        self.space, self.recordings = ROOMY, 0
        supervision = self.desk.parts.core.supervision
        self.is_paused = False
        self.disk = DiskWatch(
            directory,
            self._drop,
            lambda: self.is_paused,
            supervision,
            lambda _: self.space,
        )
        self.part = HistoryUpkeep(
            self.recorder,
            self.queries,
            Retention(),
            self.desk.event_log,
            AuditTrail(self.desk.sink, self.desk.ids),
            self.disk,
        )
        days = [log_record(id=n, at=NOW - n * DAY_S) for n in range(60)]
        drives = [odometry_record(at=NOW - n * DAY_S) for n in (29, 31, 31)]
        seen = [detection_record(at=NOW - n * DAY_S) for n in (6, 8)]
        remember(url, *days, *drives, *seen)

    async def _drop(self) -> bool:
        self.recordings -= 1
        return self.recordings >= 0

    async def look(self, at: float) -> None:
        self.desk.clock.now = at
        await self.part.look(self.desk.clock())

    def lines(self) -> list[dict[str, object]]:
        """What the log says of it."""
        kept = (one for one in self.desk.sink.records if isinstance(one, LogRecord))
        return [dict(one.slots) for one in kept if one.key == "log.history_kept"]

    def alerts(self) -> list[str]:
        """Alerts of the disk after the loop's next turn."""
        self.desk.loop.step([], self.desk.clock())
        waiting = self.desk.parts.evaluator.alerts.waiting
        found = (one.condition for one in waiting if one.condition.subject == "disk")
        return [f"{one.priority} {one.key}" for one in found]


@pytest.fixture
async def kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> AsyncIterator[Upkeep]:
    monkeypatch.setattr(upkeep, "PAUSE_S", 0.0)
    kept = Upkeep(tmp_path)
    await kept.look(0.0)
    yield kept
    kept.queries.close()
    await kept.recorder.close()


async def test_each_kind_goes_by_its_own_horizon_once_a_day(kept: Upkeep) -> None:
    await kept.look(SETTLES_S - 1.0)
    early = kept.lines()

    await kept.look(SETTLES_S)
    await kept.look(SETTLES_S + 60.0)

    # Places of a week, in one detection and in no line; poses of a month.
    assert (early, kept.lines()) == ([], [{"deleted": 2, "unplaced": 1}])
    assert kept.part.counters["history_deleted"] == 2
    audited = [one for one in kept.desk.sink.records if isinstance(one, AuditRecord)]
    assert [(one.action, one.subject) for one in audited] == [
        ("unplaced", "detections"),
        ("deleted", "odometry"),
    ]


async def test_a_day_on_which_the_database_was_away_is_taken_up_at_the_next_look(
    kept: Upkeep,
) -> None:
    aside = kept.file.rename(kept.file.with_suffix(".aside"))
    kept.file.mkdir()
    with pytest.raises(HopError):
        await kept.look(SETTLES_S)
    early = kept.lines()

    kept.file.rmdir()
    aside.rename(kept.file)
    await kept.look(SETTLES_S + 60.0)

    assert (early, len(kept.lines())) == ([], 1)


async def test_a_low_disk_is_a_p2_and_takes_a_recording_at_each_look_and_no_row(
    kept: Upkeep,
) -> None:
    found, kept.recordings = [], 5
    for space in (ROOMY, LOW, ALMOST, ROOMY):
        kept.space, kept.is_paused = space, space is ALMOST
        await kept.disk.look()
        kept.desk.clock.now += 1.0
        found.append(kept.alerts())

    low, paused = "P2 alert.disk_low", "P3 alert.recordings_paused"
    assert found == [[], [low], [low, paused], []]
    assert kept.part.counters == {"recordings_deleted": 2}
