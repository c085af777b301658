"""Outgoing safety messages: disk before answer, answers in order, newest report wins.

Telemetry has its own slots in the MQTT link, so no amount of pending telemetry delays
or drops a safety message.
"""

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from iveg.domain.errors import HopError
from iveg.robot.holds import HoldSet

_log = logging.getLogger(__name__)
_MAX_ANSWERS = 256
_UNDER_WAY = 16
"""Messages without a confirmation of the broker.  One at a time would be one report a
second over a radio that takes half a second each way, and no standstill is measured
from those."""


@dataclass(frozen=True, slots=True)
class LaneMessage:
    """Bytes for one topic, at QoS 1."""

    topic: str
    payload: bytes


class SafetyLane:
    """Keeps the hold set and sends answers and reports, in that order.

    Args:
        keep: Writes a hold set to disk; called in a thread, may raise OSError.
        publish: Sends at QoS 1; raises HopError while the broker is away.
    """

    def __init__(
        self,
        keep: Callable[[HoldSet], None],
        publish: Callable[[str, bytes], Awaitable[None]],
    ) -> None:
        self._keep = keep
        self._publish = publish
        self._to_keep: HoldSet | None = None
        self._answers: deque[LaneMessage] = deque(maxlen=_MAX_ANSWERS)
        self._kept_answers: deque[LaneMessage] = deque(maxlen=_MAX_ANSWERS)
        self._reports: dict[str, LaneMessage] = {}
        self._keep_wake, self._send_wake = asyncio.Event(), asyncio.Event()
        self._room = asyncio.Semaphore(_UNDER_WAY)
        self._disk_fails = False

    def persist(self, holds: HoldSet) -> None:
        """Store this set; only the newest is pending, since it replaces all before."""
        self._to_keep = holds
        self._keep_wake.set()

    def answer(self, message: LaneMessage) -> None:
        """Send once the hold set that it refers to is on disk; drops the oldest."""
        self._answers.append(message)
        self._keep_wake.set()

    def report(self, message: LaneMessage) -> None:
        """Send when possible; a newer report of the same topic replaces it."""
        self._reports[message.topic] = message
        self._send_wake.set()

    async def keep_forever(self) -> None:
        """Write sets and release answers until cancelled."""
        while True:
            await self._keep_wake.wait()
            self._keep_wake.clear()
            holds, self._to_keep = self._to_keep, None
            answers = list(self._answers)
            self._answers.clear()
            if holds is not None:
                await asyncio.to_thread(self._keep_once, holds)
            self._kept_answers.extend(answers)
            self._send_wake.set()

    def _keep_once(self, holds: HoldSet) -> None:
        # A full disk must not silence the robot: it is held in memory all the same,
        # and it will boot held whatever the file says.
        try:
            self._keep(holds)
        except OSError as error:
            if not self._disk_fails:
                _log.warning("the hold file cannot be written: %s", error)
            self._disk_fails = True
        else:
            if self._disk_fails:
                _log.warning("the hold file can be written again")
            self._disk_fails = False

    async def send_forever(self) -> None:
        """Publish answers, then the newest report, until cancelled."""
        async with asyncio.TaskGroup() as sending:
            while True:
                await self._send_wake.wait()
                self._send_wake.clear()
                while self._kept_answers or self._reports:
                    await self._room.acquire()
                    # Tasks begin in this order, and each is on its way at once.
                    sending.create_task(self._send(self._next()))

    def _next(self) -> LaneMessage:
        if self._kept_answers:
            return self._kept_answers.popleft()
        return self._reports.pop(next(iter(self._reports)))

    async def _send(self, message: LaneMessage) -> None:
        try:
            await self._publish(message.topic, message.payload)
        except HopError:
            pass  # lost without a broker; the next report has the state
        finally:
            self._room.release()
