"""The upkeep of the history: when it works, when it gives way, what it tells."""

from collections.abc import Sequence

import pytest

from iveg.adapters.history.purge import PurgeBatch
from iveg.domain.alerts.alert_book import BookedAlert
from iveg.domain.audit import ChainEnd
from iveg.domain.disk_space import DiskSpace
from iveg.domain.errors import HopError
from iveg.domain.records import LogRecord
from iveg.domain.retention import DAY_S, PURGE_STEPS, PurgeStep, Retention
from iveg.pipeline.audit import AuditTrail
from iveg.pipeline.retention import (
    ENOUGH_INSIDE,
    LOOK_S,
    MOST_WAITS,
    PAUSE_S,
    PURGE_S,
    SETTLES_S,
    HistoryUpkeep,
)
from tests.builders import START
from tests.unit.pipeline.desk import Desk

ROOMY, LOW, ALMOST = (DiskSpace(n * 10**8, 10**12) for n in (50, 9, 11))
ODOMETRY = PurgeStep("telemetry", "odometry")


class FakeHistory:
    """Implements ``RetainedHistory``: numbers of rows instead of rows.

    Attributes:
        due: Rows that a step has left to change; a batch takes ten.
        done: Batches, with the moment before which rows went.
        busy: How many more looks find rows that wait.
        away: Whether the database does not answer; ``audit_away``: of the audit.
        freed: Batches of room that was given back.
        recordings: Recordings of inputs.
        prepared: Moments at which tables of days were asked for (Unix s).
    """

    def __init__(self, today: int) -> None:
        self.due: dict[PurgeStep, int] = {}
        self.done: list[tuple[PurgeStep, float]] = []
        self.days = tuple(range(today, today - 500, -1))
        self.space = ROOMY
        self.inside: int | None = 0
        self.busy = self.freed = 0
        self.away = self.audit_away = False
        self.recordings = 0
        self.oldest: float | None = None
        self.prepared: list[float] = []

    @property
    def is_busy(self) -> bool:
        self.busy -= 1
        return self.busy >= 0

    async def recorded_days(self, most: int) -> Sequence[int]:
        if self.away:
            raise HopError("database", "away")
        return self.days[:most]

    async def oldest_telemetry(self) -> float | None:
        return self.oldest

    async def audit_end(self) -> ChainEnd:
        if self.audit_away:
            raise HopError("database", "away")
        return ChainEnd(7, "ab" * 32)

    async def prepare_days(self, now: float) -> None:
        self.prepared.append(now)

    async def purge(self, step: PurgeStep, before: float) -> PurgeBatch:
        rows = min(10, self.due.get(step, 0))
        self.due[step] = self.due.get(step, 0) - rows
        self.done.append((step, before))
        return PurgeBatch(rows, is_last=rows < 10)

    async def drop_recording(self) -> bool:
        self.recordings -= 1
        return self.recordings >= 0

    async def give_back(self) -> PurgeBatch:
        self.freed += 1
        return PurgeBatch(0, is_last=True)

    async def room_inside(self) -> int | None:
        return self.inside

    async def disk_space(self) -> DiskSpace:
        return self.space


class Upkeep:
    """An upkeep on a clock that is moved by hand, with the pauses that it made."""

    def __init__(self) -> None:
        self.desk = Desk()
        self.history = FakeHistory(int(START.wall // DAY_S))
        self.pauses: list[float] = []
        self.part = HistoryUpkeep(
            self.history,
            Retention(),
            self.desk.event_log,
            self.desk.parts.supervision,
            AuditTrail(self.desk.sink, self.desk.ids),
            self._rest,
        )

    async def _rest(self, seconds: float) -> None:
        self.pauses.append(seconds)

    async def look(self, at: float) -> None:
        self.desk.clock.now = at
        await self.part.look(self.desk.clock())

    def lines(self) -> list[dict[str, object]]:
        """What the log says of it."""
        kept = (one for one in self.desk.sink.records if isinstance(one, LogRecord))
        return [dict(one.slots) for one in kept if one.key == "log.history_kept"]

    def keys(self) -> list[str]:
        """The keys of all lines of the log, in order."""
        kept = (one for one in self.desk.sink.records if isinstance(one, LogRecord))
        return [one.key for one in kept]

    def alerts(self) -> list[BookedAlert]:
        """What is raised after the loop's next turn."""
        self.desk.loop.step([], self.desk.clock())
        waiting = self.desk.parts.evaluator.alerts.waiting
        return [one for one in waiting if one.condition.key == "alert.disk_low"]


async def settled() -> Upkeep:
    upkeep = Upkeep()
    await upkeep.look(0.0)
    return upkeep


async def test_the_first_purge_waits_until_the_server_has_settled() -> None:
    upkeep = await settled()
    await upkeep.look(SETTLES_S - 1.0)
    early = list(upkeep.history.done)

    await upkeep.look(SETTLES_S)

    assert early == []
    assert [step for step, _ in upkeep.history.done] == list(PURGE_STEPS)


async def test_tables_of_days_are_there_from_the_start_and_looked_after_hourly() -> (
    None
):
    upkeep = await settled()
    for minute in range(1, 10):
        await upkeep.look(60.0 * minute)

    assert upkeep.history.prepared == [START.wall, START.wall + SETTLES_S]


async def test_each_kind_goes_by_its_own_horizon_once_an_hour() -> None:
    upkeep = await settled()
    await upkeep.look(SETTLES_S)
    await upkeep.look(SETTLES_S + PURGE_S - 1.0)
    now = START.wall + SETTLES_S

    ages = {step: (now - before) / DAY_S for step, before in upkeep.history.done}

    assert len(upkeep.history.done) == len(PURGE_STEPS)
    days = {"positions": 7, "telemetry": 30, "decisions": 365, "audit": 400}
    assert ages == {step: pytest.approx(days[step.kind]) for step in PURGE_STEPS}


async def test_many_rows_go_in_batches_with_a_pause_after_each() -> None:
    upkeep = await settled()
    upkeep.history.due = {ODOMETRY: 35, PURGE_STEPS[0]: 12}

    await upkeep.look(SETTLES_S)

    assert [step for step, _ in upkeep.history.done].count(ODOMETRY) == 4
    assert upkeep.pauses == [PAUSE_S] * 4
    assert upkeep.part.counters == {"history_deleted": 35, "history_unplaced": 12}


async def test_it_gives_way_to_rows_that_wait() -> None:
    upkeep = await settled()
    upkeep.history.busy = 3

    await upkeep.look(SETTLES_S)

    assert upkeep.pauses == [1.0] * 3
    assert len(upkeep.history.done) == len(PURGE_STEPS)


async def test_a_recorder_that_never_catches_up_leaves_the_purge_to_the_next_look() -> (
    None
):
    upkeep = await settled()
    upkeep.history.busy = MOST_WAITS + 1

    with pytest.raises(HopError):
        await upkeep.look(SETTLES_S)
    none = list(upkeep.history.done)
    await upkeep.look(SETTLES_S + LOOK_S)

    assert none == []
    assert len(upkeep.history.done) == len(PURGE_STEPS)


async def test_a_line_a_day_says_what_went() -> None:
    upkeep = await settled()
    upkeep.history.due = {ODOMETRY: 7}

    for hour in range(49):
        await upkeep.look(SETTLES_S + hour * PURGE_S)

    assert upkeep.lines()[0] == {"deleted": 7, "unplaced": 0}
    assert upkeep.lines()[1:] == [{"deleted": 0, "unplaced": 0}] * 2


async def test_a_day_whose_audit_cannot_be_asked_for_is_logged_an_hour_later() -> None:
    upkeep = await settled()
    upkeep.history.audit_away = True
    with pytest.raises(HopError):
        await upkeep.look(SETTLES_S)
    early = upkeep.lines()

    upkeep.history.audit_away = False
    await upkeep.look(SETTLES_S + PURGE_S)

    assert early == []
    assert upkeep.keys() == ["log.history_kept", "log.audit_day"]


async def test_a_low_disk_is_a_p2_until_it_is_well_again() -> None:
    upkeep = await settled()
    found = []
    for n, space in enumerate((ROOMY, LOW, ALMOST, ROOMY)):
        upkeep.history.space = space
        await upkeep.look(10.0 + n)
        found.append([one.priority for one in upkeep.alerts()])

    assert found == [[], ["P2"], ["P2"], []]


async def test_a_low_disk_is_told_while_the_database_is_away() -> None:
    upkeep = await settled()
    upkeep.history.away, upkeep.history.space = True, LOW

    with pytest.raises(HopError):
        await upkeep.look(1.0)

    assert len(upkeep.alerts()) == 1


async def test_a_low_disk_takes_a_day_of_telemetry_at_each_look_and_no_decision() -> (
    None
):
    upkeep = await settled()
    upkeep.history.oldest = oldest = START.wall - 20 * DAY_S
    upkeep.history.space = LOW

    await upkeep.look(1.0)

    now = START.wall + 1.0
    before = dict(upkeep.history.done)
    ages = {step: (now - at) / DAY_S for step, at in before.items()}
    assert before[ODOMETRY] == oldest + DAY_S
    assert {ages[step] for step in PURGE_STEPS if step.kind == "decisions"} == {365.0}
    assert {ages[step] for step in PURGE_STEPS if step.kind == "audit"} == {400.0}
    assert upkeep.history.freed == 1


@pytest.mark.parametrize("inside", [None, ENOUGH_INSIDE])
async def test_a_low_disk_takes_nothing_where_that_makes_no_room(
    inside: int | None,
) -> None:
    upkeep = await settled()
    upkeep.history.space, upkeep.history.inside = LOW, inside

    await upkeep.look(1.0)

    assert upkeep.history.done == []
    assert len(upkeep.alerts()) == 1


async def test_a_low_disk_takes_recordings_before_telemetry() -> None:
    upkeep = await settled()
    upkeep.history.oldest = START.wall - 20 * DAY_S
    upkeep.history.space, upkeep.history.recordings = LOW, 2

    for minute in (1.0, 2.0, 3.0):
        await upkeep.look(minute)
        left = 0 if minute < 3.0 else 1
        assert upkeep.history.freed == left

    assert upkeep.part.counters["recordings_deleted"] == 2
