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
from collections.abc import Awaitable, Callable, Iterable
from itertools import chain

from iveg.domain.alerts import SHOWN_S
from iveg.domain.events import Condition, Slot
from iveg.domain.observations import (
    Instant,
)

_log = logging.getLogger(__name__)

FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 60.0
"""Between the first failure of a part and its restart, and at most."""
LONGEST_TURN_S = 0.25
"""CPU that one turn of the loop may take; more delays STOP and feedback."""


EVENTS = (
    "measured",
    "notified",
    "entity_read",
    "arrived",
    "frame_taken",
    "obstacle_reported",
    "goal_answered",
    "aged",
    "judged",
    "decided",
    "ticked",
    "raised",
    "changed",
    "appended",
)
"""Events that vital code tells, with the facts that a listener is given.

- ``measured(topic, payload, at)``: a robot's own message was read
- ``notified(body, at)``: a notification was read
- ``entity_read(EntityReading, at)``: Orion said something of other equipment
- ``arrived(Received)``: a copy of a message of the fleet came, by either transport
- ``frame_taken(DetectionFrame, sighted, at)``: a detection frame is judged
- ``obstacle_reported(SafetyReport, at)``: a robot of today reported what its laser sees
- ``goal_answered(GoalAnswer, at, TransportId)``
- ``aged(now)``: time has passed for the world, which is not judged yet
- ``judged(DetectionRule, limits, changes, now)``
- ``decided(received, now)``: a judgement is over, and this is what it was made of
- ``ticked(now)``
- ``raised(alerts)``
- ``changed(topic)``: a live topic has changed
- ``appended(topic, item)``: a live topic has a new item, which every browser is sent
"""


class Supervision:
    """Comfort parts by name: what failed when, and what holds up the loop.

    Args:
        clock: Reads both clocks.
        first_pause_s: Before the first restart of a part.

    Attributes:
        counters: Failures by part, and long turns, since the start.
    """

    def __init__(
        self, clock: Callable[[], Instant], first_pause_s: float = FIRST_PAUSE_S
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._clock = clock
        self._listeners: dict[str, list[tuple[str, Callable[..., object]]]] = {
            event: [] for event in EVENTS
        }
        self._first_pause_s = first_pause_s
        self._failed_at: dict[str, float] = {}
        self._stopped: set[str] = set()
        """Parts that wait for their restart."""
        self._long_turn = float("-inf"), 0.0
        """When the newest long turn ended (monotonic, s), and its CPU (s)."""
        self._found: dict[str, tuple[Condition, ...]] = {}

    def listen(self, part: str, **calls: Callable[..., object]) -> None:
        """Have a part of comfort told of these events, after all who listen already.

        Raises:
            KeyError: there is no such event.
        """
        for event, call in calls.items():
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

    def note_turn(self, cpu_s: float) -> None:
        """One turn of the loop is over, which took so much CPU (s)."""
        if cpu_s > LONGEST_TURN_S:
            self.counters["long_turn"] += 1
            self._long_turn = self._clock().mono, cpu_s

    def conditions(self, now: Instant) -> Iterable[Condition]:
        """A P3 for each part that is down, a P2 while the loop was held up.

        Beside them, what parts have reported.
        """
        yield from chain.from_iterable(self._found.values())
        for part in self._failed_at:
            if self._is_down(part, now):
                yield Condition("P3", "alert.part_down", part, None, {"part": part})
        ended_at, cpu_s = self._long_turn
        if now.mono - ended_at < SHOWN_S:
            slots: dict[str, Slot] = {"ms": round(1000.0 * cpu_s)}
            yield Condition("P2", "alert.loop_held_up", "loop", None, slots)

    def _is_down(self, part: str, now: Instant) -> bool:
        """Whether it waits for its restart, or failed so recently that it may again."""
        failed_at = self._failed_at.get(part)
        recent = failed_at is not None and now.mono - failed_at < SHOWN_S
        return recent or part in self._stopped
