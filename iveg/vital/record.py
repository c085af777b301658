"""Queue of records on their way to the history.

The queue is bounded: the oldest telemetry gives way first, then the oldest of all but
orders, and is counted.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from iveg.domain.records import Record, is_order, is_telemetry

CAPACITY = 20_000
ODOMETRY_PERIOD_S = 0.5
"""Two poses a second and robot are enough to draw any minute of the past."""


class RecordSink(Protocol):
    """Port of the history's recorder."""

    def enqueue(self, record: Record) -> None:
        """Queue a record; never blocks and never fails."""

    async def flushed(self) -> None:
        """Return when every command and audit row so far is durable."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A queued record.

    Attributes:
        revision: Rises with every record; of two states of a row the higher counts.
        since: Time at which it was offered (monotonic, s).
    """

    record: Record
    revision: int
    since: float


class RecordQueue:
    """A bounded queue in which all but orders give way, telemetry first.

    Three lanes share one capacity, so that making room costs the same for the first
    and for the twenty-thousandth record.
    """

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._capacity = capacity
        self._orders: deque[Waiting] = deque()
        self._kept: deque[Waiting] = deque()
        self._telemetry: deque[Waiting] = deque()
        self._lanes = (self._orders, self._kept, self._telemetry)
        self.dropped = 0
        """Records that gave way."""

    def __len__(self) -> int:
        return sum(map(len, self._lanes))

    def enqueue(self, waiting: Waiting) -> None:
        """Append a record; a full queue drops an older one."""
        self._lane(waiting).append(waiting)
        self._make_room()

    def dequeue(self, most: int) -> list[Waiting]:
        """Remove the next records: orders first, telemetry last."""
        batch: list[Waiting] = []
        for lane in self._lanes:
            while lane and len(batch) < most:
                batch.append(lane.popleft())
        return batch

    def put_back(self, batch: Sequence[Waiting]) -> None:
        """Put records that could not be stored back in front, in their order."""
        # Reversed, so that the first record of the batch is the first again.
        for waiting in reversed(batch):
            self._lane(waiting).appendleft(waiting)
        self._make_room()

    def oldest_since(self) -> float | None:
        """Offer time of the record that has waited longest; None when empty."""
        return min((lane[0].since for lane in self._lanes if lane), default=None)

    def _lane(self, waiting: Waiting) -> deque[Waiting]:
        if is_order(waiting.record):
            return self._orders
        return self._telemetry if is_telemetry(waiting.record) else self._kept

    def _make_room(self) -> None:
        # Orders never give way: a queue of orders alone may exceed its capacity.
        while len(self) > self._capacity and (self._telemetry or self._kept):
            (self._telemetry or self._kept).popleft()
            self.dropped += 1
