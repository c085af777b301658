"""Keeps the history and its disk in bounds, beside the rule loop.

Once a minute it looks at the disk, once a day (UTC) it takes from the history what is
over, one piece after the other.  Where the disk is low, people are told, and the oldest
recordings of inputs go before their time.
"""

import asyncio
import contextlib
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from typing import Protocol

from iveg.domain.audit import ITSELF
from iveg.domain.errors import HopError
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.retention import DAY_S, PURGE_STEPS, DiskSpace, PurgeStep, Retention
from iveg.vital.audit import AuditTrail
from iveg.vital.event_log import EventLog
from iveg.vital.ports import Clock
from iveg.vital.supervision import Supervision

PART = "retention"
LOOK_S = 60.0
SETTLES_S = 300.0
"""A server that has just started has other things to do."""
PAUSE_S = 0.1
"""Between two pieces: rows that wait to be written come in between."""


class RetainedHistory(Protocol):
    """The history as its upkeep sees it; each question may raise HopError."""

    async def recorded_days(self, most: int) -> Sequence[int]:
        """Days (UTC, since 1970) with a line in the log, newest first."""

    async def purge(self, step: PurgeStep, before: float) -> int:
        """Take a piece of a step, of rows older than this (Unix s).

        Returns:
            Number of rows; 0: nothing is left to do.
        """

    async def drop_recording(self) -> bool:
        """Delete the oldest recording of inputs; whether there was one."""

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
        self._settled_at: float | None = None
        self._purged_day: int | None = None

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
        if self._settled_at is None:
            self._settled_at = now.mono + SETTLES_S
        day = int(now.wall // DAY_S)
        if now.mono >= self._settled_at and day != self._purged_day:
            await self._purge(now)
            # Where the database fails before, the day is taken up at the next look.
            self._purged_day = day

    async def _look_at_disk(self) -> None:
        space = await self._history.disk_space()
        self._supervision.report(PART, space.conditions(was_low=self._is_low))
        self._is_low = space.is_low(was_low=self._is_low)
        if self._is_low and await self._history.drop_recording():
            self.counters["recordings_deleted"] += 1

    async def _purge(self, now: Instant) -> None:
        recorded = await self._history.recorded_days(self._retention.longest)
        cutoffs = self._retention.cutoffs(now.wall, recorded)
        slots = {"deleted": 0, "unplaced": 0}
        for step in PURGE_STEPS:
            if step.kind not in cutoffs:
                continue
            rows = await self._take(step, cutoffs[step.kind])
            done = "unplaced" if step.kind == "positions" else "deleted"
            self.counters[f"history_{done}"] += rows
            slots[done] += rows
            if rows:
                details = {"rows": rows, "before": cutoffs[step.kind]}
                self._trail.note(ITSELF, done, step.table, details, at=now)
        # By this line a day is recorded also where nothing else happens.
        self._event_log.log(LogEvent("system", "log.history_kept", slots), now)

    async def _take(self, step: PurgeStep, before: float) -> int:
        rows = 0
        while took := await self._history.purge(step, before):
            rows += took
            await self._rest(PAUSE_S)
        return rows
