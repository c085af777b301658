"""Input of the pipeline: a queue, bounded for each robot and kind.

All transports end here.  When more comes of one robot and kind than can be taken, the
oldest of these is dropped and counted.  A robot that floods loses its own messages, and
telemetry displaces no safety report.  A detection frame that is dropped counts as
unreadable: somebody may have been in it.
"""

import asyncio
import logging
from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import replace

from iveg.domain.errors import UnknownRobotError
from iveg.domain.kinds import KIND_OF
from iveg.domain.observations import (
    Copy,
    DetectionFrame,
    Observation,
    Received,
    RefusedFrame,
    kind_of,
)
from iveg.domain.world import World
from iveg.vital.waiting import wait_set

_log = logging.getLogger(__name__)

MOST_WAITING = 500
"""Most messages of a robot and kind: eleven seconds of a detector at 45 Hz."""
_CONTINUED = -1
"""Count of a stream that has gone on after its first message; below every ``seq``."""
_MOST_BOOTS = 1000
_MOST_LOGGED = 500
"""Most kinds of rejections that are logged of a robot, or of all strangers."""


class Ingest:
    """Holds what has arrived until the rule loop takes it.

    Args:
        world: The fleet; it knows which robots and frames of odometry are refused.
        passed: Called with each copy of a message of the fleet, before it is queued.
        rejected: Called once for each new kind of rejection, with source and reason.
    """

    def __init__(
        self,
        world: World,
        passed: Callable[[Received], None],
        rejected: Callable[[str, str], None],
    ) -> None:
        self._world, self._passed, self._rejected = world, passed, rejected
        self._queue: deque[Received] = deque()
        self._refused: dict[str, Received] = {}
        """By robot, a note that one of its detection frames was dropped."""
        self._waiting: Counter[_Stream] = Counter()
        """Number of waiting messages, by robot and kind."""
        self._due: dict[_Stream, float] = {}
        """Earliest moment to read the next message of a stream (monotonic, s)."""
        self._first: dict[tuple[str, type[Observation], str | None], int] = {}
        """``seq`` of the first message by robot, kind and boot; -1 after a second."""
        self._wake = asyncio.Event()
        self._named: set[tuple[str, str]] = set()
        self._logged: Counter[str | None] = Counter()
        self.counters: Counter[str] = Counter()

    def enqueue(self, received: Received) -> None:
        """Queue one observation; never blocks."""
        robot_id = received.observation.robot_id
        if robot_id and robot_id not in self._world.robots:
            self.reject(robot_id, "unknown_robot", str(UnknownRobotError(robot_id)))
            return
        if self._world.is_refused(robot_id):
            self.reject(robot_id, "refused_robot", "is not heard, by a setting")
            return
        if (frame := self._world.misplaced(received.observation)) is not None:
            self.reject(robot_id, "unknown_frame", f"odometry: {frame}")
            return
        name = kind_of(received.observation).__name__
        # An answer to a query is no message: counted, it would hide a lost message.
        way = "asked" if received.is_query_answer else received.transport
        self.counters[f"{way}.{name}"] += 1
        if received.alone:
            # A claim without proof counts for nothing, but boxes may show somebody.
            self.counters[f"alone.{name}"] += 1
            if not isinstance(received.observation, DetectionFrame):
                return
        elif not isinstance(received.observation, RefusedFrame):
            self._passed(received)
        if isinstance(received.observation, Copy):
            self.counters[f"{name}.duplicate"] += 1
            return
        stream = _stream(received)
        if self._waiting[stream] >= MOST_WAITING:
            self._drop_oldest(stream)
        self._queue.append(received)
        self._waiting[stream] += 1
        self._wake.set()

    def enqueue_copy(self, received: Received) -> None:
        """Queue a message that FIWARE brought, from the second of a boot on.

        An agent that starts gets what the broker kept, and does not mark it.  So the
        first message is only a claim, and a second with a higher ``seq`` proves a link.
        Boxes slow robots at once.
        """
        observation = received.observation
        if KIND_OF[kind_of(observation)].speaks_alone and self._is_alone(observation):
            received = replace(received, alone=True)
        self.enqueue(received)

    def _is_alone(self, observation: Observation) -> bool:
        """Whether it is the first message of its boot, or a copy of it."""
        seq = observation.origin.seq
        boot = None if seq is None else observation.origin.boot
        stream = observation.robot_id, kind_of(observation), boot
        first = self._first.get(stream)
        if first is None:
            # A robot that reboots for ever must not fill the memory.
            if len(self._first) >= _MOST_BOOTS:
                del self._first[next(iter(self._first))]
            self._first[stream] = _CONTINUED if seq is None else seq
            return True
        if (seq or 0) > first:
            self._first[stream] = _CONTINUED
        return (seq or 0) <= first

    def is_known(
        self, robot_id: str, kind: type[Observation], boot: object, seq: object
    ) -> bool:
        """Whether a message with this boot and count was taken before."""
        robot = self._world.robots.get(robot_id)
        return robot is not None and robot.order_of(kind).knows(boot, seq)

    def is_early(self, robot_id: str, kind: type[Observation], now: float) -> bool:
        """Whether a message may be skipped: its kind was read a moment ago."""
        due_at = self._due.get((robot_id, kind), 0.0)
        if now >= due_at:
            self._due[robot_id, kind] = now + KIND_OF[kind].apart_s
        return now < due_at

    def reject(self, source: str, reason: str, detail: str = "") -> None:
        """Count a message that cannot be used; log its kind once for each source."""
        self.counters[f"rejected.{reason}"] += 1
        key = (source, reason)
        if key in self._named or not self._may_log(source):
            return
        self._named.add(key)
        _log.warning("rejected from %s: %s %s", source, reason, detail)
        self._rejected(source, reason)

    def _may_log(self, source: str) -> bool:
        """Whether the log has room for a source; each robot has its own."""
        robot_id = source.partition("_")[0]
        owner = robot_id if robot_id in self._world.robots else None
        self._logged[owner] += 1
        return self._logged[owner] <= _MOST_LOGGED

    @property
    def waiting(self) -> int:
        """Number of pending messages."""
        return len(self._queue)

    def drain(self) -> Iterable[Received]:
        """Everything that waits, oldest first."""
        waiting, self._queue = self._queue, deque()
        notes, self._refused = self._refused, {}
        self._waiting.clear()
        return *waiting, *notes.values()

    async def wait(self, timeout_s: float) -> None:
        """Return when something waits, or after a while."""
        await wait_set(self._wake, timeout_s)

    def _drop_oldest(self, stream: "_Stream") -> None:
        index, dropped = next(
            (index, waiting)
            for index, waiting in enumerate(self._queue)
            if _stream(waiting) == stream
        )
        del self._queue[index]
        self._waiting[stream] -= 1
        robot_id, kind = stream
        self.counters[f"dropped.{kind.__name__}"] += 1
        if kind is DetectionFrame:
            refused = replace(dropped, observation=RefusedFrame(robot_id))
            self._refused[robot_id] = refused


_Stream = tuple[str, type[Observation]]


def _stream(received: Received) -> _Stream:
    """Robot and kind of a message."""
    observation = received.observation
    return observation.robot_id, type(observation)
