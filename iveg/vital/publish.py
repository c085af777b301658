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
_Waits = TypeVar("_Waits")


class Subscriber:
    """Changes that one browser has not been sent yet.

    Attributes:
        dirty: State topics that changed and are sent at once, longest waiting first.
        telemetry: The same of those whose sending is paced.
        wants_telemetry: False while no telemetry could be sent: a change is noted and
            wakes nobody.
    """

    def __init__(self) -> None:
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
        """Queue an event, which is never dropped."""
        if len(self.pending) >= MAX_PENDING:
            self.overflowed = True
        else:
            self.pending.append((topic, item))
        self.wake()

    async def news(self, within_s: float | None = None) -> None:
        """Wait until there may be something to take, or for that long (s)."""
        await wait_set(self._awake, within_s)

    def drain_events(self) -> list[tuple[str, object]]:
        """Every event since the last time, in order."""
        return _taken(self.pending)

    def drain_topics(self) -> list[str]:
        """The topics that changed and are sent at once."""
        return _taken(self.dirty)

    def drain_telemetry(self) -> list[str]:
        """The topics that changed and are paced."""
        return _taken(self.telemetry)


def _taken(waiting: dict[_Waits, None] | deque[_Waits]) -> list[_Waits]:
    taken = list(waiting)
    waiting.clear()
    return taken


class Hub:
    """Connected browsers, and a version for each topic."""

    def __init__(self) -> None:
        self.versions: Counter[str] = Counter()
        self._subscribers: set[Subscriber] = set()

    @property
    def watchers(self) -> int:
        """Number of connected browsers."""
        return len(self._subscribers)

    def join(self) -> Subscriber:
        """Add a browser."""
        subscriber = Subscriber()
        self._subscribers.add(subscriber)
        return subscriber

    def leave(self, subscriber: Subscriber) -> None:
        """Remove a browser."""
        self._subscribers.discard(subscriber)

    def changed(self, topic: str) -> None:
        """Mark a state topic as changed."""
        self.versions[topic] += 1
        for subscriber in self._subscribers:
            subscriber.changed(topic)

    def append(self, topic: str, item: object) -> None:
        """Queue an event for every browser; none is dropped."""
        for subscriber in self._subscribers:
            subscriber.append(topic, item)
