"""Keeps the history and its disk in bounds, beside the rule loop.

Once a minute it looks at the disk, once an hour it takes from the history what is over,
one small batch after the other: rows that wait to be written go first.  Where the disk
is low, people are told, and the oldest go before their time: recordings of inputs, then
telemetry.
"""

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import Protocol

from iveg.domain.audit import ITSELF, ChainEnd
from iveg.domain.disk_space import DiskSpace
from iveg.domain.errors import HopError
from iveg.domain.events import LogEvent, Slot
from iveg.domain.observations import Instant
from iveg.domain.retention import (
    DAY_S,
    PURGE_STEPS,
    SPARED_DAYS,
    Cutoffs,
    PurgeStep,
    Retention,
    squeezed,
)
from iveg.pipeline.audit import AuditTrail
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.ports import Clock
from iveg.pipeline.supervision import Supervision

_log = logging.getLogger(__name__)
PART = "retention"
LOOK_S, PURGE_S = 60.0, 3600.0
SETTLES_S = 300.0
"""A server that has just started has other things to do."""
ENOUGH_INSIDE = 10**8
"""Bytes: a file with so much room inside does not grow for a while."""
PAUSE_S, BUSY_S = 0.1, 1.0
"""Between two batches of at most 20 ms; and while rows wait to be written."""
MOST_WAITS = 60
"""Pauses for rows that wait; then the next look goes on with it."""


class PurgeBatch(Protocol):
    """What one batch did."""

    @property
    def rows(self) -> int:
        """Rows that it changed."""

    @property
    def is_last(self) -> bool:
        """Whether nothing is left to do."""


class RetainedHistory(Protocol):
    """The history as its upkeep sees it; each question may raise HopError."""

    @property
    def is_busy(self) -> bool:
        """Whether rows wait that go first."""

    async def room_inside(self) -> int | None:
        """Bytes of its file that new rows fill first; None on a server's own disk."""

    async def recorded_days(self, most: int) -> Sequence[int]:
        """Days (UTC, since 1970) with a line in the log, newest first."""

    async def oldest_telemetry(self) -> float | None:
        """The oldest row of telemetry (Unix s)."""

    async def audit_end(self) -> ChainEnd:
        """The newest row of the audit."""

    async def prepare_days(self, now: float) -> None:
        """Have tables of days that come, where it keeps one for each (Unix s)."""

    async def purge(self, step: PurgeStep, before: float) -> PurgeBatch:
        """One batch of a step, of rows older than this (Unix s)."""

    async def drop_recording(self) -> bool:
        """Delete the oldest recording of inputs; whether there was one."""

    async def give_back(self) -> PurgeBatch:
        """One batch of room that is given back to the disk."""

    async def disk_space(self) -> DiskSpace:
        """Room on the disk of the data."""


class HistoryUpkeep:
    """Has rows leave the history when their time is over.

    Args:
        history: The history.
        retention: How long what is kept.
        event_log: Gets a line a day.
        supervision: Told of a disk that is low.
        trail: Told what was deleted.
        rest: Waits (s).

    Attributes:
        counters: ``history_deleted`` and ``history_unplaced`` rows since the start.
    """

    def __init__(
        self,
        history: RetainedHistory,
        retention: Retention,
        event_log: EventLog,
        supervision: Supervision,
        trail: AuditTrail,
        rest: Callable[[float], Awaitable[object]] = asyncio.sleep,
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._history = history
        self._retention = retention
        self._event_log = event_log
        self._supervision = supervision
        self._trail = trail
        self._rest = rest
        self._is_low = False
        self._purges_at: float | None = None
        self._logged_day: int | None = None
        self._logged: Counter[str] = Counter()

    async def run(self, clock: Clock) -> None:
        """Until cancelled."""
        while True:
            # A database that is away is the recorder's to report.
            with contextlib.suppress(HopError):
                await self.look(clock())
            await self._rest(LOOK_S)

    async def look(self, now: Instant) -> None:
        """Look at the disk, and purge where that is due.

        Raises:
            HopError: the database is away, or the disk cannot be read.
        """
        await self._look_at_disk()
        if self._purges_at is None:
            await self._history.prepare_days(now.wall)
            self._purges_at = now.mono + SETTLES_S
        is_due = now.mono >= self._purges_at
        if is_due:
            await self._history.prepare_days(now.wall)
        squeezes = self._is_low and await self._squeezes_history()
        if is_due or squeezes:
            await self._purge(now, squeezes=squeezes)
        if is_due:
            self._purges_at = now.mono + PURGE_S
            await self._tell(now)

    async def _look_at_disk(self) -> None:
        space = await self._history.disk_space()
        self._supervision.report(PART, space.conditions(was_low=self._is_low))
        self._is_low = space.is_low(was_low=self._is_low)

    async def _squeezes_history(self) -> bool:
        """Whether deleting telemetry makes room that is not there already.

        Recordings go first, one at each look.
        """
        if await self._history.drop_recording():
            self.counters["recordings_deleted"] += 1
            return False
        inside = await self._history.room_inside()
        return inside is not None and inside < ENOUGH_INSIDE

    async def _purge(self, now: Instant, *, squeezes: bool) -> None:
        wall = now.wall
        most = max(self._retention.longest, SPARED_DAYS)
        recorded = await self._history.recorded_days(most)
        cutoffs = self._retention.cutoffs(wall, recorded)
        if squeezes:
            oldest = await self._history.oldest_telemetry()
            cutoffs = squeezed(cutoffs, oldest, wall, recorded)
        await self._remove(cutoffs, now)
        if squeezes:
            await self._batches(self._history.give_back)

    async def _remove(self, cutoffs: Cutoffs, now: Instant) -> None:
        for step in PURGE_STEPS:
            if step.kind not in cutoffs:
                continue
            batch = partial(self._history.purge, step, cutoffs[step.kind])
            rows = await self._batches(batch)
            done = "unplaced" if step.kind == "positions" else "deleted"
            self.counters[f"history_{done}"] += rows
            if rows:
                details = {"rows": rows, "before": cutoffs[step.kind]}
                self._trail.note(ITSELF, done, step.table, details, at=now)

    async def _batches(self, batch: Callable[[], Awaitable[PurgeBatch]]) -> int:
        rows = 0
        while True:
            await self._give_way()
            did = await batch()
            rows += did.rows
            if did.is_last:
                return rows
            await self._rest(PAUSE_S)

    async def _give_way(self) -> None:
        """Wait while rows are to be written; not for ever: the disk counts, too."""
        for _ in range(MOST_WAITS):
            if not self._history.is_busy:
                return
            await self._rest(BUSY_S)
        raise HopError("database", "rows that wait to be written leave no time")

    async def _tell(self, now: Instant) -> None:
        """A line a day, by which days are recorded also where nothing happens."""
        day = int(now.wall // DAY_S)
        if day == self._logged_day:
            return
        # Where the database fails here the day is logged an hour later, whole.
        end = await self._history.audit_end()
        fresh = self.counters - self._logged
        self._logged_day, self._logged = day, Counter(self.counters)
        slots = {
            "deleted": fresh["history_deleted"],
            "unplaced": fresh["history_unplaced"],
        }
        self._event_log.log(LogEvent("system", "log.history_kept", slots), now)
        sealed: dict[str, Slot] = {"rows": end.seq, "hash": end.hash}
        self._event_log.log(LogEvent("system", "log.audit_day", sealed), now)
        _log.info("audit: row %d, hash %s", end.seq, end.hash)
