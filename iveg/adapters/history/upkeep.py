"""The history as its upkeep sees it: batches of the one writer, and the disk."""

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path

from iveg.adapters import clock
from iveg.adapters.disk import disk_space
from iveg.adapters.history import ages
from iveg.adapters.history.audit import chain_end
from iveg.adapters.history.day_partitions import prepare_days
from iveg.adapters.history.engine import sqlite_file
from iveg.adapters.history.purge import (
    PurgeBatch,
    give_back,
    purge_batch,
    room_inside,
)
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder
from iveg.domain.disk_space import DiskSpace
from iveg.domain.errors import HopError
from iveg.domain.retention import PurgeStep


async def _no_recording() -> bool:
    return False


class RecordedHistory:
    """Implements ``pipeline.retention.RetainedHistory``.

    Args:
        recorder: The one writer.
        queries: Its reading side.
        directory: Of the data, whose disk is watched.
        stopwatch: Bounds each batch; monotonic (s).
        read_space: Room on the disk of a directory.
        drop_recording: Deletes the oldest recording of inputs, if there is one.
    """

    def __init__(
        self,
        recorder: Recorder,
        queries: Queries,
        directory: Path,
        stopwatch: Callable[[], float] = clock.mono,
        read_space: Callable[[Path], DiskSpace] = disk_space,
        drop_recording: Callable[[], Coroutine[object, object, bool]] = _no_recording,
    ) -> None:
        self._recorder = recorder
        self._directory = directory
        self._stopwatch = stopwatch
        self._read_space = read_space
        self._is_file = sqlite_file(queries.url) is not None
        self.recorded_days = lambda most: queries.ask(ages.recorded_days, most)
        self.oldest_telemetry = lambda: queries.ask(ages.oldest_telemetry)
        self.audit_end = lambda: queries.ask(chain_end)
        self.drop_recording = drop_recording

    @property
    def is_busy(self) -> bool:
        """Whether rows wait that go first."""
        return self._recorder.is_busy

    async def prepare_days(self, now: float) -> None:
        """Have tables of days that come, on PostgreSQL (Unix s)."""
        await self._recorder.between_batches(
            lambda connection: prepare_days(connection, now)
        )

    async def purge(self, step: PurgeStep, before: float) -> PurgeBatch:
        """One batch of a step, of rows older than this (Unix s)."""
        return await self._recorder.between_batches(
            lambda connection: purge_batch(connection, step, before, self._stopwatch)
        )

    async def give_back(self) -> PurgeBatch:
        """One batch of room that is given back to the disk."""
        return await self._recorder.between_batches(
            lambda connection: give_back(connection, self._stopwatch)
        )

    async def room_inside(self) -> int | None:
        """Bytes of its file that new rows fill first; None on a server's own disk."""
        if not self._is_file:
            return None
        return await self._recorder.between_batches(room_inside)

    async def disk_space(self) -> DiskSpace:
        """Room on the disk of the data."""
        try:
            return await asyncio.to_thread(self._read_space, self._directory)
        except OSError as error:
            raise HopError("disk", error.strerror or str(error)) from error
