"""The upkeep of the history: when it works, when it gives way, what it tells."""

from collections.abc import Sequence

import pytest

from iveg.comfort.retention import PAUSE_S, SETTLES_S, HistoryUpkeep
from iveg.domain.alerts import BookedAlert
from iveg.domain.errors import HopError
from iveg.domain.records import LogRecord
from iveg.domain.retention import DAY_S, PURGE_STEPS, DiskSpace, PurgeStep, Retention
from iveg.vital.audit import AuditTrail
from tests.builders import START
from tests.unit.vital.desk import Desk

ROOMY, LOW, ALMOST = (DiskSpace(n * 10**8, 10**12) for n in (50, 9, 11))
ODOMETRY = PurgeStep("telemetry", "odometry")


class FakeHistory:
    """Implements ``RetainedHistory``: numbers of rows instead of rows.

    Attributes:
        due: Rows that a step has left to change; a piece takes ten.
        done: Pieces, with the moment before which rows went.
        away: Whether the database does not answer.
        recordings: Recordings of inputs.
    """

    def __init__(self, today: int) -> None:
        self.due: dict[PurgeStep, int] = {}
        self.done: list[tuple[PurgeStep, float]] = []
        self.days = tuple(range(today, today - 500, -1))
        self.space = ROOMY
        self.away = False
        self.recordings = 0

    async def recorded_days(self, most: int) -> Sequence[int]:
        if self.away:
            raise HopError("database", "away")
        return self.days[:most]

    async def purge(self, step: PurgeStep, before: float) -> int:
        rows = min(10, self.due.get(step, 0))
        self.due[step] = self.due.get(step, 0) - rows
        self.done.append((step, before))
        return rows

    async def drop_recording(self) -> bool:
        self.recordings -= 1
        return self.recordings >= 0

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
            self.desk.parts.core.supervision,
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


async def test_each_kind_goes_by_its_own_horizon_once_a_day() -> None:
    upkeep = await settled()
    await upkeep.look(SETTLES_S)
    await upkeep.look(SETTLES_S + 60.0)
    now = START.wall + SETTLES_S

    ages = {step: (now - before) / DAY_S for step, before in upkeep.history.done}

    assert len(upkeep.history.done) == len(PURGE_STEPS)
    days = {"positions": 7, "telemetry": 30, "decisions": 365, "audit": 400}
    assert ages == {step: pytest.approx(days[step.kind]) for step in PURGE_STEPS}


async def test_many_rows_go_in_pieces_with_a_pause_after_each() -> None:
    upkeep = await settled()
    upkeep.history.due = {ODOMETRY: 35, PURGE_STEPS[0]: 12}

    await upkeep.look(SETTLES_S)

    assert [step for step, _ in upkeep.history.done].count(ODOMETRY) == 5
    assert upkeep.pauses == [PAUSE_S] * 6
    assert upkeep.part.counters == {"history_deleted": 35, "history_unplaced": 12}


async def test_a_day_on_which_the_database_was_away_is_taken_up_at_the_next_look() -> (
    None
):
    upkeep = await settled()
    upkeep.history.away = True
    with pytest.raises(HopError):
        await upkeep.look(SETTLES_S)
    early = upkeep.lines()

    upkeep.history.away = False
    await upkeep.look(SETTLES_S + 60.0)

    assert (early, len(upkeep.lines())) == ([], 1)


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
        await upkeep.look(SETTLES_S)

    assert len(upkeep.alerts()) == 1


async def test_a_low_disk_takes_a_recording_at_each_look_and_no_row() -> None:
    upkeep = await settled()
    upkeep.history.space, upkeep.history.recordings = LOW, 2

    for second in (1.0, 2.0, 3.0):
        await upkeep.look(second)

    assert upkeep.part.counters == {"recordings_deleted": 2}
    assert upkeep.history.done == []
