"""The input of the pipeline: a queue, bounded for each robot and kind.

All transports end here.  When more comes of one robot and kind than can be taken, the
oldest of these is dropped and counted: a robot that floods drops its own, and telemetry
drops no safety report.  A detection frame that is dropped counts as one that could not
be read: somebody may have been in it.
"""

import asyncio
import logging
from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import replace

from iveg.domain.errors import UnknownRobotError
from iveg.domain.kinds import KIND_OF, KINDS
from iveg.domain.observations import (
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
"""Of one robot and kind, the newest: eleven seconds of a detector at 45 Hz."""
_LINKED = tuple(kind.of for kind in KINDS if kind.speaks_alone)
_GOES_ON = -1
"""Below every count."""
_MOST_BOOTS = 1000
_MOST_LOGGED = 500
"""Kinds of rejections that are logged of one robot, or of all strangers together."""


class Ingest:
    """Holds what has arrived until the rule loop takes it.

    Args:
        world: The fleet; knows who is heard, and what a stream is past.
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
        """By robot, that one of its detection frames was dropped."""
        self._waiting: Counter[_Stream] = Counter()
        """How much waits, by robot and kind."""
        self._due: dict[_Stream, float] = {}
        """When the next of a robot and kind is read directly (monotonic, s)."""
        self._first: dict[tuple[str, type[Observation], str | None], int] = {}
        """By robot, kind and boot: the count of the first, until another came."""
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
        # What we asked for is no message: it would hide that one was lost.
        way = "asked" if received.asked else received.transport
        self.counters[f"{way}.{name}"] += 1
        if received.alone:
            self.counters[f"alone.{name}"] += 1
            if not isinstance(received.observation, DetectionFrame):
                return
        elif not isinstance(received.observation, RefusedFrame):
            self._passed(received)
        stream = _stream(received)
        if self._waiting[stream] >= MOST_WAITING:
            self._drop_oldest(stream)
        self._queue.append(received)
        self._waiting[stream] += 1
        self._wake.set()

    def enqueue_copy(self, received: Received) -> None:
        """Queue what FIWARE brought, from the second of a boot on.

        An agent that starts is given what the broker kept, and tells nobody so: one
        message is a claim, and two that count on are a link.  Boxes slow at once.
        """
        observation = received.observation
        is_alone = kind_of(observation) in _LINKED and self._is_alone(observation)
        self.enqueue(replace(received, alone=True) if is_alone else received)

    def _is_alone(self, observation: Observation) -> bool:
        """Whether it is the first of its boot, or that again."""
        seq = observation.origin.seq
        boot = None if seq is None else observation.origin.boot
        stream = observation.robot_id, kind_of(observation), boot
        first = self._first.get(stream)
        if first is None:
            if len(self._first) >= _MOST_BOOTS:
                del self._first[next(iter(self._first))]
            self._first[stream] = _GOES_ON if seq is None else seq
            return True
        if (seq or 0) > first:
            self._first[stream] = _GOES_ON
        return (seq or 0) <= first

    def is_early(self, robot_id: str, kind: type[Observation], now: float) -> bool:
        """Whether nobody would look at it: one of its kind was read a moment ago."""
        due = self._due.get((robot_id, kind), 0.0)
        if now >= due:
            self._due[robot_id, kind] = now + KIND_OF[kind].apart_s
        return now < due

    def reject(self, source: str, reason: str, detail: str = "") -> None:
        """Count something that cannot be used; say so once for each source."""
        self.counters[f"rejected.{reason}"] += 1
        key = (source, reason)
        if key in self._named or not self._may_log(source):
            return
        self._named.add(key)
        _log.warning("rejected from %s: %s %s", source, reason, detail)
        self._rejected(source, reason)

    def _may_log(self, source: str) -> bool:
        """Whether there is room: whoever uses up the own leaves that of others."""
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
        refused, self._refused = self._refused, {}
        self._waiting.clear()
        return *waiting, *refused.values()

    async def wait(self, timeout_s: float) -> None:
        """Return when something waits, or after a while."""
        await wait_set(self._wake, timeout_s)

    def _drop_oldest(self, stream: "_Stream") -> None:
        index, dropped = next(
            (index, one)
            for index, one in enumerate(self._queue)
            if _stream(one) == stream
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
