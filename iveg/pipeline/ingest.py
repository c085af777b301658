"""The door of the pipeline: a bounded queue that prefers what people's safety needs.

All transports end here.  When more comes than can be taken, the oldest telemetry gives
way and is counted; safety reports and answers of robots never do.
"""

import asyncio
import logging
from collections import Counter, deque
from collections.abc import Callable, Iterable

from iveg.domain.errors import UnknownRobotError
from iveg.domain.observations import (
    Observation,
    Received,
    kind_of,
)
from iveg.pipeline.kinds import kind

_log = logging.getLogger(__name__)

MAX_QUEUED = 2000
_MAX_TOLD = 500


class Ingest:
    """Holds what has arrived until the rule loop takes it.

    Args:
        known: Whether a robot id belongs to the fleet.
        rejected: Called once for each new kind of rejection, with source and reason.
        is_past: What need not be read; whoever reads messages asks it.
        passed: Told of each copy of a message of the fleet, before it waits.
    """

    def __init__(
        self,
        known: Callable[[str], bool],
        rejected: Callable[[str, str], None] | None = None,
        is_past: Callable[[str, type[Observation], str, int], bool] = lambda *_: False,
        passed: Callable[[Received], None] = lambda _: None,
    ) -> None:
        self._known = known
        self._passed = passed
        self.is_past = is_past
        self._rejected = rejected
        self._queue: deque[Received] = deque()
        self._wake = asyncio.Event()
        self._told: set[tuple[str, str]] = set()
        self.counters: Counter[str] = Counter()

    def offer(self, received: Received) -> None:
        """Take one observation; never blocks."""
        robot_id = getattr(received.observation, "robot_id", None)
        if robot_id is not None and not self._known(robot_id):
            self.reject(robot_id, "unknown_robot", str(UnknownRobotError(robot_id)))
            return
        name = kind_of(received.observation).__name__
        # What we asked for is no message: it would hide that one was lost.
        way = "asked" if received.asked else received.road
        self.counters[f"{way}.{name}"] += 1
        self._passed(received)
        if len(self._queue) >= MAX_QUEUED:
            self._make_room()
        self._queue.append(received)
        self._wake.set()

    def reject(self, source: str, reason: str, detail: str = "") -> None:
        """Count something that cannot be used; say so once for each source."""
        self.counters[f"rejected.{reason}"] += 1
        key = (source, reason)
        if key in self._told or len(self._told) >= _MAX_TOLD:
            return
        self._told.add(key)
        _log.warning("rejected from %s: %s %s", source, reason, detail)
        if self._rejected is not None:
            self._rejected(source, reason)

    @property
    def waiting(self) -> int:
        """How much waits to be taken."""
        return len(self._queue)

    def drain(self) -> Iterable[Received]:
        """Everything that waits, oldest first."""
        while self._queue:
            yield self._queue.popleft()

    async def wait(self, timeout_s: float) -> None:
        """Return when something waits, or after a while."""
        try:
            async with asyncio.timeout(timeout_s):
                await self._wake.wait()
        except TimeoutError:
            return
        self._wake.clear()

    def _make_room(self) -> None:
        for index, waiting in enumerate(self._queue):
            if kind(waiting.observation).may_drop:
                name = type(waiting.observation).__name__
                self.counters[f"dropped.{name}"] += 1
                del self._queue[index]
                return
