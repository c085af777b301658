"""Records on their way to the history, and which of them give way under pressure.

Odometry is thinned before it is offered.  The queue is bounded, and its overflow is a
decision: the oldest telemetry gives way and is counted, everything else stays.
"""

from collections import deque
from dataclasses import dataclass
from typing import Protocol

from iveg.domain.records import OdometryRecord, Record, is_telemetry

CAPACITY = 20_000
ODOMETRY_PERIOD_S = 0.5
"""Two poses a second and robot are enough to draw any minute of the past."""


class RecordSink(Protocol):
    """Port of the history's recorder."""

    def enqueue(self, record: Record) -> None:
        """Queue a record; never blocks and never fails."""

    async def flushed(self) -> None:
        """Return when every command and audit row so far is durable."""


class OdometryThinner:
    """Keeps 2 Hz a robot, and every change of what it was told, applies, or its link.

    The period is counted in the record's own time; one that jumps backwards (a clock
    that was set) starts a new period rather than silencing the robot.
    """

    def __init__(self) -> None:
        self._last: dict[str, OdometryRecord] = {}

    def thin(self, record: OdometryRecord) -> OdometryRecord | None:
        """The record if it is worth keeping, else None."""
        last = self._last.get(record.robot_id)
        if last is not None and not _tells_more(last, record):
            return None
        self._last[record.robot_id] = record
        return record


def _tells_more(last: OdometryRecord, record: OdometryRecord) -> bool:
    said = (last.limit_factor, last.applied_factor, last.link)
    if said != (record.limit_factor, record.applied_factor, record.link):
        return True
    # Robots tick at 10 or 20 Hz: half a tick early must not wait a whole tick more.
    return not 0.0 <= record.at - last.at < 0.95 * ODOMETRY_PERIOD_S


@dataclass(frozen=True, slots=True)
class Waiting:
    """A queued record.

    Attributes:
        revision: Grows with every record; of two states of one thing the higher counts.
        since: When it was offered, monotonic seconds.
    """

    record: Record
    revision: int
    since: float


class RecordQueue:
    """A bounded queue in which telemetry alone gives way.

    Two lanes share one capacity, so that making room costs the same for the first and
    for the twenty-thousandth record.
    """

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._capacity = capacity
        self._kept: deque[Waiting] = deque()
        self._telemetry: deque[Waiting] = deque()
        self.dropped = 0
        """Telemetry that gave way."""

    def __len__(self) -> int:
        return len(self._kept) + len(self._telemetry)

    def enqueue(self, waiting: Waiting) -> None:
        """Append a record; a full queue lets go of its oldest telemetry.

        A queue full of records that may not be dropped grows: losing one of those is
        worse than the few hundred bytes that it takes.
        """
        lane = self._telemetry if is_telemetry(waiting.record) else self._kept
        lane.append(waiting)
        self._make_room()

    def dequeue(self, most: int) -> list[Waiting]:
        """Remove the next records, those that may not be lost first."""
        batch = self.dequeue_kept(most)
        while self._telemetry and len(batch) < most:
            batch.append(self._telemetry.popleft())
        return batch

    def dequeue_kept(self, most: int) -> list[Waiting]:
        """Remove only records that may not be lost."""
        return [self._kept.popleft() for _ in range(min(most, len(self._kept)))]

    def put_back(self, batch: list[Waiting]) -> None:
        """Return what was taken and could not be stored, to where it stood."""
        for waiting in reversed(batch):
            lane = self._telemetry if is_telemetry(waiting.record) else self._kept
            lane.appendleft(waiting)
        self._make_room()

    def oldest_since(self) -> float | None:
        """When the record that has waited longest was offered; None when empty."""
        heads = [lane[0].since for lane in (self._kept, self._telemetry) if lane]
        return min(heads, default=None)

    def _make_room(self) -> None:
        while len(self) > self._capacity and self._telemetry:
            self._telemetry.popleft()
            self.dropped += 1
