"""Messages to people outside iVeg, which hold up nothing else.

``enqueue_raised`` is called where alerts are raised and only fills bounded queues.
Each address has a task of its own, which sends all waiting alerts as one message and
rests.  Alerts of a failed message stay queued; the next message says since when.
"""

import asyncio
import logging
from collections import Counter, deque
from collections.abc import Awaitable, Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from iveg.domain.alerts import BookedAlert
from iveg.domain.events import Address, AlertItem, MessagePlan, MessageText
from iveg.vital.alerting import Alerting
from iveg.vital.core import Core

_log = logging.getLogger(__name__)
PART: Final = "messages"

Write = Callable[[Sequence[AlertItem], bool], MessageText]
SendMessage = Callable[[Address, MessageText], Awaitable[str | None]]

MOST_WAITING: Final = 100
"""Alerts that wait for one address; the oldest gives way and is counted."""
_LOOK_S: Final = 5.0


@dataclass(frozen=True, slots=True)
class Pace:
    """Time between messages to one address, and for one message.

    Attributes:
        rest_s: Pause after a message (s): a flood of alerts is two messages a minute.
        limit_s: A message that takes longer (s) counts as failed; its end is awaited.
    """

    rest_s: float = 30.0
    limit_s: float = 60.0


class _Line:
    """Alerts that wait for one address."""

    def __init__(self, address: Address) -> None:
        self.address = address
        self.items: deque[AlertItem] = deque(maxlen=MOST_WAITING)
        self.filled = asyncio.Event()


class Messenger:
    """Sends alerts to the addresses of a plan.

    Args:
        send: Brings a message to an address; returns the reason of a failure, or None.
        write: Makes the message of some alerts; the flag says that they escalate.
        alerts: Alerts that are still waiting for somebody.

    Attributes:
        counters: Messages that were taken or failed, and alerts that were dropped.
    """

    def __init__(
        self,
        plan: MessagePlan,
        send: SendMessage,
        write: Write,
        alerts: Alerting,
        core: Core,
        pace: Pace = Pace(),
    ) -> None:
        self.counters: Counter[str] = Counter()
        self._lines = [_Line(address) for address in plan.addresses]
        self._escalate_after_s = plan.escalate_after_s
        self._send_message, self._write = send, write
        self._alerts, self._clock, self._pace = alerts, core.ports.clock, pace
        self._since: dict[str, float] = {}
        self._escalated: set[str] = set()
        self._logged: set[tuple[str, str]] = set()
        core.supervision.listen(PART, raised=self.enqueue_raised)

    def enqueue_raised(self, raised: Iterable[BookedAlert]) -> None:
        """Queue alerts that were raised for every address that wants them."""
        for alert in raised:
            self._enqueue(AlertItem(alert.last.priority, alert.last.raised))

    def escalate(self) -> None:
        """Queue alerts that are unacknowledged for too long for the second list."""
        now = self._clock().mono
        unseen = {
            alert.alert_id: alert for alert in self._alerts.waiting if alert.unseen
        }
        self._since = {name: self._since.get(name, now) for name in unseen}
        self._escalated &= unseen.keys()
        for name, since in self._since.items():
            alert, is_late = unseen[name], now - since >= self._escalate_after_s
            if is_late and name not in self._escalated and alert.unseen:
                self._escalated.add(name)
                self._enqueue(AlertItem(alert.unseen, alert.raised), escalates=True)

    async def run(self) -> None:
        """Send for ever, to each address by itself."""
        async with asyncio.TaskGroup() as tasks:
            for line in self._lines:
                tasks.create_task(self._serve(line))
            while True:
                self.escalate()
                await asyncio.sleep(_LOOK_S)

    def _enqueue(self, item: AlertItem, *, escalates: bool = False) -> None:
        for line in self._lines:
            address = line.address
            if address.escalates == escalates and item.priority <= address.least:
                # A full deque drops its oldest by itself.
                self.counters["messages.dropped"] += len(line.items) == MOST_WAITING
                line.items.append(item)
                line.filled.set()

    async def _serve(self, line: _Line) -> None:
        while True:
            await line.filled.wait()
            items = list(line.items)
            # Emptied before the send: alerts that come meanwhile are the next message.
            line.items.clear()
            line.filled.clear()
            if not await self._is_taken(line.address, items):
                line.items.extendleft(reversed(items))
                line.filled.set()
            await asyncio.sleep(self._pace.rest_s)

    async def _is_taken(self, to: Address, items: Sequence[AlertItem]) -> bool:
        sending = asyncio.ensure_future(self._send(to, items))
        finished, _ = await asyncio.wait([sending], timeout=self._pace.limit_s)
        if not finished:
            self._failed(to, "no answer")
        # The end of the send decides: a taken message must not be repeated.
        failed = await sending
        if failed is not None:
            self._failed(to, failed)
            return False
        self.counters["messages.sent"] += 1
        # The address works, so its next failure is news and is logged.
        self._logged = {
            (name, reason) for name, reason in self._logged if name != to.name
        }
        return True

    async def _send(self, to: Address, items: Sequence[AlertItem]) -> str | None:
        try:
            return await self._send_message(to, self._write(items, to.escalates))
        except Exception as error:
            # Only the type: the error's text may hold the address.
            return type(error).__name__

    def _failed(self, to: Address, why: str) -> None:
        self.counters["messages.failed"] += 1
        if (to.name, why) not in self._logged:
            self._logged.add((to.name, why))
            _log.warning("messages to %s fail: %s", to.name, why)
