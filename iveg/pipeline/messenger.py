"""Tells people outside iVeg of alerts: beside everything, in the way of nothing.

``enqueue_raised`` is called where alerts are raised and only fills a bounded queue;
each channel has a task of its own that waits, sends, and rests::

    raised ──> queue of the channel ──> everything that waits, as one message ──> rest
                    ^                                  │ nobody was reached, twice more
                    └──────────────────────────────────┘

What fails is counted and shown, beside the alert and on the Settings page.
"""

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from iveg.domain.alerts.alert_book import BookedAlert
from iveg.domain.contacts import Contacts
from iveg.domain.errors import HopError
from iveg.domain.events import LogEvent
from iveg.domain.messages import (
    CHANNELS,
    AlertItem,
    Channel,
    MessageDelivery,
    OutboundMessage,
)
from iveg.pipeline.alerting import Alerting
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.ports import ChoiceStore, Clock, MessageSender

_log = logging.getLogger(__name__)

MOST_WAITING = 100
"""Alerts that wait for one channel; the oldest gives way and is counted."""
REST_S = 30.0
"""Between two messages of one channel: a flood of alerts is two messages a minute."""
TRIES = 3
LIMIT_S = 15.0
"""For one message to everybody of a channel, however slowly a server answers."""


class Messenger:
    """Sends alerts to people outside iVeg; holds recipients and pending messages.

    Attributes:
        contacts: Whom, as an operator wants it.
        last: What came of the newest message of each channel.
        counters: Sent, failed and dropped.
    """

    def __init__(
        self,
        contacts: Contacts,
        store: ChoiceStore[Contacts],
        senders: Mapping[Channel, MessageSender],
        alerts: Alerting,
        event_log: EventLog,
        clock: Clock,
        rest_s: float = REST_S,
        limit_s: float = LIMIT_S,
    ) -> None:
        self.contacts = contacts
        self.last: dict[Channel, Sequence[MessageDelivery]] = {}
        self.counters: Counter[str] = Counter()
        self._store = store
        self._senders = senders
        self._alerts = alerts
        self._event_log = event_log
        self._clock = clock
        self._rest_s = rest_s
        self._limit_s = limit_s
        self._changing = asyncio.Lock()
        self._waiting: dict[Channel, asyncio.Queue[AlertItem]] = {
            name: asyncio.Queue(MOST_WAITING) for name in CHANNELS
        }

    def enqueue_raised(self, raised: Iterable[BookedAlert]) -> None:
        """Queue alerts that were raised for every channel that wants them."""
        for alert in raised:
            last, key = alert.last, alert.condition.key
            item = AlertItem(alert.alert_id, last.priority, key, last.raised)
            for channel in CHANNELS:
                if self.contacts.wants(channel, item.priority):
                    self._wait(channel, item)

    async def run(self) -> None:
        """Send for ever, each channel by itself."""
        async with asyncio.TaskGroup() as tasks:
            for channel in CHANNELS:
                tasks.create_task(self._serve(channel), name=f"message-{channel}")

    async def test(self, channel: Channel) -> Sequence[MessageDelivery]:
        """Try a channel now, whether or not it is on."""
        return await self._send(channel, OutboundMessage())

    async def change(
        self, update: Callable[[Contacts], Contacts], channel: Channel, by: str
    ) -> None:
        """Tell others, or otherwise, from now on.

        Raises:
            HopError: it could not be written down; all stays as it was.
        """
        await self._change(update)
        line = LogEvent("system", f"log.messages_changed.{channel}", {"by": by})
        self._event_log.log(line, self._clock())

    async def _change(self, update: Callable[[Contacts], Contacts]) -> None:
        async with self._changing:
            changed = update(self.contacts)
            await self._store.save(changed)
            self.contacts = changed

    def _wait(self, channel: Channel, item: AlertItem) -> None:
        waiting = self._waiting[channel]
        if waiting.full():
            waiting.get_nowait()
            self.counters["messages.dropped"] += 1
        waiting.put_nowait(item)

    async def _serve(self, channel: Channel) -> None:
        while True:
            waiting = self._waiting[channel]
            items = [await waiting.get()]
            while not waiting.empty():
                items.append(waiting.get_nowait())
            try:
                await self._deliver(channel, items)
            except Exception:
                # A message must never end what supervises robots.
                _log.exception("what came of a message by %s is not known", channel)
            await asyncio.sleep(self._rest_s)

    async def _deliver(self, channel: Channel, items: Sequence[AlertItem]) -> None:
        deliveries = await self._send(channel, OutboundMessage(tuple(items)))
        for item in items:
            self._alerts.record_deliveries(item.alert_id, item.raised, deliveries)
        if deliveries and all(one.failed for one in deliveries):
            for item in items:
                if item.tries + 1 < TRIES:
                    self._wait(channel, replace(item, tries=item.tries + 1))

    async def _send(
        self, channel: Channel, message: OutboundMessage
    ) -> Sequence[MessageDelivery]:
        now, sender = self._clock(), self._senders[channel]
        try:
            async with asyncio.timeout(self._limit_s):
                deliveries = await sender.send(self.contacts, message, now)
        except TimeoutError:
            deliveries = [MessageDelivery(channel, "", now, "no_answer")]
        except Exception:
            _log.exception("a message by %s failed", channel)
            deliveries = [MessageDelivery(channel, "", now, "internal")]
        self.last[channel] = deliveries
        for one in deliveries:
            outcome = "failed" if one.failed else "sent"
            self.counters[f"messages.{outcome}.{channel}"] += 1
        await self._forget_gone(deliveries)
        return deliveries

    async def _forget_gone(self, deliveries: Sequence[MessageDelivery]) -> None:
        """A browser that its push service no longer knows has left."""
        gone = {one.device_id or "" for one in deliveries if one.failed == "gone"}
        if gone:
            with contextlib.suppress(HopError):
                await self._change(lambda contacts: contacts.without(gone))
