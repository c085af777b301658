"""Publishing to browsers: one hub, one slot for each topic and browser.

A state topic only remembers that it changed, so a slow browser gets the newest value
and never a queue.  Log lines and command steps are events: each is kept until it is
sent; a browser that lets them pile up is sent back for a snapshot.
"""

import asyncio
from collections import Counter, deque
from typing import TypeVar

from iveg.vital.topics import is_telemetry
from iveg.vital.waiting import wait_set

MAX_PENDING = 1000
_Item = TypeVar("_Item")


class Subscriber:
    """Changes that one browser has not been sent yet.

    Attributes:
        dirty: Changed state topics to send at once, longest waiting first.
        telemetry: Changed state topics whose sending is paced, likewise ordered.
        pending: Events, oldest first.
        wants_telemetry: False while no telemetry could be sent: a change is noted and
            wakes nobody.
        overflowed: Whether events were lost, so that the browser needs a snapshot.
    """

    def __init__(self) -> None:
        # Dicts as sets that keep their order.
        self.dirty: dict[str, None] = {}
        self.telemetry: dict[str, None] = {}
        self.pending: deque[tuple[str, object]] = deque()
        self.overflowed = False
        self.wants_telemetry = True
        self._awake = asyncio.Event()

    def wake(self) -> None:
        """Signal that there is something to take."""
        self._awake.set()

    def changed(self, topic: str) -> None:
        """Mark a state topic as changed."""
        if not is_telemetry(topic):
            self.dirty[topic] = None
            self.wake()
            return
        self.telemetry[topic] = None
        if self.wants_telemetry:
            self.wake()

    def append(self, topic: str, item: object) -> None:
        """Queue an event; a full queue sends the browser back for a snapshot."""
        # No event may be lost: the snapshot holds the events that are not queued.
        if len(self.pending) >= MAX_PENDING:
            self.overflowed = True
        else:
            self.pending.append((topic, item))
        self.wake()

    async def news(self, within_s: float | None = None) -> None:
        """Wait until there may be something to take, at most ``within_s`` (s)."""
        await wait_set(self._awake, within_s)


def drain(waiting: dict[_Item, None] | deque[_Item]) -> list[_Item]:
    """Take everything that waits, in its order."""
    items = list(waiting)
    waiting.clear()
    return items


class Hub:
    """Connected browsers, and a version for each topic."""

    def __init__(self) -> None:
        self.versions: Counter[str] = Counter()
        self.subscribers: set[Subscriber] = set()

    def join(self) -> Subscriber:
        """Add a browser."""
        subscriber = Subscriber()
        self.subscribers.add(subscriber)
        return subscriber

    def leave(self, subscriber: Subscriber) -> None:
        """Remove a browser."""
        self.subscribers.discard(subscriber)

    def changed(self, topic: str) -> None:
        """Mark a state topic as changed."""
        self.versions[topic] += 1
        for subscriber in self.subscribers:
            subscriber.changed(topic)

    def append(self, topic: str, item: object) -> None:
        """Queue an event for every browser."""
        for subscriber in self.subscribers:
            subscriber.append(topic, item)
