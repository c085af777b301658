"""Keeps comfort away from what is vital: a part that fails is named and comes back.

Vital is what a STOP or a speed limit needs; everything else is comfort
(docs/architecture.md, "Vital and comfort").  Vital code never imports comfort: it tells
an event, and whoever listens is guarded here, so that no drawing, statistic or row of
the history can end a STOP::

    runs ── fails ──> down, P3 ── after a pause that doubles ──> runs
"""

import asyncio
import logging
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import TypedDict, Unpack, cast

from iveg.domain.alerts import SHOWN_S, BookedAlert
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.events import Condition, Slot
from iveg.domain.feedback import SpeedLimit
from iveg.domain.observations import (
    DetectionFrame,
    EntityReading,
    GoalAnswer,
    Instant,
    Received,
    SafetyReport,
)
from iveg.domain.rule.zones import LimitChange
from iveg.domain.transports import TransportId

_log = logging.getLogger(__name__)

FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 60.0
"""Between the first failure of a part and its restart, and at most."""
LONGEST_TURN_S = 0.25
"""CPU that one turn of the loop may take; more delays STOP and feedback."""


class Listeners(TypedDict, total=False):
    """Events, and the facts that a listener is given."""

    measured: Callable[[str, bytes, Instant], object]
    """A robot's own message was read: topic, payload, and when."""
    notified: Callable[[bytes, Instant], object]
    """A notification was read."""
    entity_read: Callable[[EntityReading, Instant], object]
    """Orion said something of other equipment."""
    arrived: Callable[[Received], object]
    """A copy of a message of the fleet came, by either transport."""
    frame_taken: Callable[[DetectionFrame, Instant, Instant], object]
    """A detection frame is judged: its source's moment, and when it came."""
    obstacle_reported: Callable[[SafetyReport, Instant], object]
    """A robot of today reported what its laser sees."""
    goal_answered: Callable[[GoalAnswer, Instant, TransportId], object]
    aged: Callable[[Instant], object]
    """Time has passed for the world, which is not judged yet."""
    judged: Callable[
        [DetectionRule, Mapping[str, SpeedLimit], Sequence[LimitChange], Instant],
        object,
    ]
    decided: Callable[[Iterable[Received], Instant], object]
    """A judgement is over, and this is what it was made of."""
    ticked: Callable[[Instant], object]
    raised: Callable[[Sequence[BookedAlert]], object]
    changed: Callable[[str], object]
    """A live topic has changed."""
    appended: Callable[[str, object], object]
    """A live topic has a new item, which every browser is sent."""


class Supervision:
    """Comfort parts by name: what failed when, and what holds up the loop.

    Args:
        clock: Reads both clocks.
        first_pause_s: Before the first restart of a part.

    Attributes:
        counters: Failures and long turns since the start, by part.
    """

    def __init__(
        self, clock: Callable[[], Instant], first_pause_s: float = FIRST_PAUSE_S
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._clock = clock
        self._listeners: dict[str, list[tuple[str, Callable[..., object]]]] = {
            event: [] for event in Listeners.__annotations__
        }
        self._first_pause_s = first_pause_s
        self._failed_at: dict[str, float] = {}
        self._stopped: set[str] = set()
        """Parts that wait for their restart."""
        self._minute = 0
        self._longest_s = 0.0, 0.0
        """Longest turn of this minute, and of the one before (s)."""
        self._long_turns: dict[str, tuple[float, float]] = {}
        """Part → when its newest long turn ended (monotonic, s), and its CPU (s)."""
        self._found: dict[str, tuple[Condition, ...]] = {}

    def listen(self, part: str, **calls: Unpack[Listeners]) -> None:
        """Have a part of comfort told of these events, after all who listen already."""
        for event, call in cast("Mapping[str, Callable[..., object]]", calls).items():
            self._listeners[event].append((part, call))

    def tell(self, event: str, *facts: object) -> None:
        """Tell an event; a listener that fails fails alone."""
        for part, call in self._listeners[event]:
            self.guard(part, call, *facts)

    def guard(self, part: str, call: Callable[..., object], *facts: object) -> None:
        """Call a part of comfort, whose failure is not its caller's."""
        try:
            call(*facts)
        except Exception as error:
            self.failed(part, error)

    def failed(self, part: str, error: BaseException) -> None:
        """Count a failure of a part; logged once, until the part is well again."""
        now = self._clock()
        self.counters[f"comfort_failed.{part}"] += 1
        if not self._is_down(part, now):
            _log.error("%s has failed; what is vital goes on", part, exc_info=error)
        self._failed_at[part] = now.mono

    async def keep_running(
        self, part: str, work: Callable[[], Awaitable[object]]
    ) -> None:
        """Run a part until it returns; after each failure again, ever later."""
        pause_s = self._first_pause_s
        while True:
            began = self._clock().mono
            try:
                await work()
                return
            except Exception as error:
                self.failed(part, error)
            if self._clock().mono - began > LONGEST_PAUSE_S:
                pause_s = self._first_pause_s
            self._stopped.add(part)
            await asyncio.sleep(pause_s)
            self._stopped.discard(part)
            pause_s = min(LONGEST_PAUSE_S, 2.0 * pause_s)

    def report(self, part: str, wrong: Iterable[Condition]) -> None:
        """Take the conditions of a part in the place of its earlier ones."""
        self._found[part] = tuple(wrong)

    def note_turn(self, part: str, cpu_s: float) -> None:
        """One turn of the loop is over, which took so much CPU (s)."""
        now = self._clock()
        self._pass_minutes(now)
        this, before = self._longest_s
        self._longest_s = max(this, cpu_s), before
        if cpu_s > LONGEST_TURN_S:
            self.counters[f"long_turn.{part}"] += 1
            self._long_turns[part] = now.mono, cpu_s

    def longest_turn_s(self, now: Instant) -> float:
        """CPU of the longest turn of this minute and of the one before (s)."""
        self._pass_minutes(now)
        return max(self._longest_s)

    def _pass_minutes(self, now: Instant) -> None:
        minute = int(now.mono // 60.0)
        for _ in range(min(2, minute - self._minute)):
            self._longest_s = 0.0, self._longest_s[0]
        self._minute = minute

    def conditions(self, now: Instant) -> Iterable[Condition]:
        """A P3 for each part that is down, a P2 for each that held up the loop.

        Beside them, what parts have reported.
        """
        yield from chain.from_iterable(self._found.values())
        for part in self._failed_at:
            if self._is_down(part, now):
                yield Condition("P3", "alert.part_down", part, None, {"part": part})
        for part, (at, cpu_s) in self._long_turns.items():
            if now.mono - at < SHOWN_S:
                slots: dict[str, Slot] = {"part": part, "ms": round(1000.0 * cpu_s)}
                yield Condition("P2", "alert.loop_held_up", part, None, slots)

    def _is_down(self, part: str, now: Instant) -> bool:
        """Whether it waits for its restart, or failed so recently that it may again."""
        failed_at = self._failed_at.get(part)
        recent = failed_at is not None and now.mono - failed_at < SHOWN_S
        return recent or part in self._stopped
