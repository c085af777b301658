"""Supervision of comfort: a part that fails is named, restarted and harms no STOP.

Vital is what a STOP or a speed limit needs; everything else is comfort
(docs/architecture.md, "Vital and comfort").  Vital code never imports comfort: it
publishes events, and their listeners are guarded here, so that no drawing, statistic or
row of the history can end a STOP::

    runs ── fails ──> down, P3 ── after a pause that doubles ──> runs
"""

import asyncio
import logging
from collections import Counter
from collections.abc import Callable, Coroutine, Iterable, Mapping
from itertools import chain

from iveg.domain.alerts import SHOWN_S
from iveg.domain.errors import VitalPartError
from iveg.domain.events import Condition
from iveg.domain.observations import Instant

_log = logging.getLogger(__name__)
Work = Callable[[], Coroutine[object, object, object]]

FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 60.0
"""Pause before the first restart of a part, and the longest pause (s)."""
LONGEST_TURN_S = 0.25
"""CPU time that one turn of the loop may take (s); more delays STOP and feedback."""
LAST_WORD_S = 0.5
"""Time limit of the last feedback (s); 0.5 s later robots slow by themselves."""

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
"""Events of vital code, with the arguments of a listener.

- ``measured(topic, payload, at)``: a robot's own message was read
- ``notified(body, at)``: a notification was read
- ``entity_read(EntityReading, at)``: Orion sent values of other equipment
- ``arrived(Received)``: a copy of a message of the fleet came, by either transport
- ``frame_taken(DetectionFrame, sighted, at)``: a detection frame is judged
- ``obstacle_reported(SafetyReport, at)``: a live robot reported an obstacle
- ``goal_answered(GoalAnswer, at, TransportId)``
- ``aged(now)``: the world has aged and is not judged yet
- ``judged(DetectionRule, limits, changes, now)``
- ``decided(received, now)``: a judgement is over; it rests on these messages
- ``ticked(now)``
- ``raised(alerts)``
- ``changed(topic)``: a live topic has changed
- ``appended(topic, item)``: a live topic has a new item for every browser
"""


class Supervision:
    """Record of failed comfort parts, and of long turns of the loop.

    Args:
        clock: Reads both clocks.
        first_pause_s: Pause before the first restart of a part (s).

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
        """End of the newest long turn (monotonic, s), and its CPU time (s)."""
        self._reported: dict[str, tuple[Condition, ...]] = {}

    def listen(self, part: str, **calls: Callable[..., object]) -> None:
        """Register a part of comfort for events, after the earlier listeners.

        Raises:
            KeyError: there is no such event.
        """
        for event, call in calls.items():
            self._listeners[event].append((part, call))

    def tell(self, event: str, *facts: object) -> None:
        """Publish an event; a failing listener stops neither caller nor others."""
        for part, call in self._listeners[event]:
            self.guard(part, call, *facts)

    def guard(self, part: str, call: Callable[..., object], *facts: object) -> None:
        """Call a part of comfort; its failure is counted and goes no further."""
        # Exception alone: a cancellation must reach its task.
        try:
            call(*facts)
        except Exception as error:
            self.failed(part, error)

    def failed(self, part: str, error: BaseException) -> None:
        """Count a failure of a part; logs the first until the part is well again."""
        now = self._clock()
        self.counters[f"comfort_failed.{part}"] += 1
        if not self._is_down(part, now):
            _log.error(
                "%s has failed; STOP and speed limits go on", part, exc_info=error
            )
        self._failed_at[part] = now.mono

    async def run(
        self, vital: Mapping[str, Work], comfort: Mapping[str, Work], last_word: Work
    ) -> None:
        """Run all parts until cancelled.

        Args:
            vital: Vital parts by name; none may end.
            comfort: Parts of comfort by name; each is started again when it fails.
            last_word: Sends the last feedback when a vital part has ended.

        Raises:
            VitalPartError: a vital part has ended.
        """
        tasks = [asyncio.create_task(work(), name=name) for name, work in vital.items()]
        beside = [
            asyncio.create_task(self.keep_running(name, work), name=name)
            for name, work in comfort.items()
        ]
        try:
            ended, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            # Before the other parts are cancelled: the link must send it.
            await _say(last_word)
            task = ended.pop()
            raise VitalPartError(task.get_name()) from task.exception()
        finally:
            for task in (*tasks, *beside):
                task.cancel()
            await asyncio.gather(*tasks, *beside, return_exceptions=True)

    async def keep_running(self, part: str, work: Work) -> None:
        """Run a part until it returns; restart it after failures, ever later."""
        pause_s = self._first_pause_s
        while True:
            began = self._clock().mono
            try:
                await work()
                return
            except Exception as error:
                self.failed(part, error)
            # A long run was a sound one: the part starts again with the short pause.
            if self._clock().mono - began > LONGEST_PAUSE_S:
                pause_s = self._first_pause_s
            self._stopped.add(part)
            await asyncio.sleep(pause_s)
            self._stopped.discard(part)
            pause_s = min(LONGEST_PAUSE_S, 2.0 * pause_s)

    def report(self, part: str, conditions: Iterable[Condition]) -> None:
        """Replace the conditions that a part reports."""
        self._reported[part] = tuple(conditions)

    def note_turn(self, cpu_s: float) -> None:
        """Note the CPU time of a turn of the loop (s)."""
        if cpu_s > LONGEST_TURN_S:
            self.counters["long_turn"] += 1
            self._long_turn = self._clock().mono, cpu_s

    def conditions(self, now: Instant) -> Iterable[Condition]:
        """Conditions of parts, a P3 for a part that is down, a P2 for a long turn."""
        yield from chain.from_iterable(self._reported.values())
        for part in self._failed_at:
            if self._is_down(part, now):
                yield Condition.filled("P3", "alert.part_down", part, part=part)
        ended_at, cpu_s = self._long_turn
        if now.mono - ended_at < SHOWN_S:
            yield Condition.filled(
                "P2", "alert.loop_held_up", "loop", ms=round(1000.0 * cpu_s)
            )

    def _is_down(self, part: str, now: Instant) -> bool:
        """Whether a part waits for its restart or has failed within ``SHOWN_S``."""
        failed_at = self._failed_at.get(part)
        recent = failed_at is not None and now.mono - failed_at < SHOWN_S
        return recent or part in self._stopped


async def _say(last_word: Work) -> None:
    try:
        async with asyncio.timeout(LAST_WORD_S):
            await last_word()
    except Exception:
        # The link that sends it may be the part that has failed.
        _log.exception("the last feedback failed; robots slow by themselves")
