"""From what changed to who looks: one hub, a slot a topic and browser.

A state topic only remembers that it changed, so a slow browser gets the newest value
and never a queue.  Log lines and command steps are events: each is kept until it is
sent; a browser that lets them pile up is told to come back for a snapshot.
"""

import asyncio
from collections import Counter, deque
from typing import Any

MAX_PENDING = 1000


class Subscriber:
    """One browser's view of what it has not seen yet."""

    def __init__(self) -> None:
        self.dirty: dict[str, None] = {}
        self.pending: deque[tuple[str, Any]] = deque()
        self.overflowed = False
        self._wake = asyncio.Event()

    def wake(self) -> None:
        """There is something to take."""
        self._wake.set()

    async def take(self) -> tuple[list[tuple[str, Any]], list[str]]:
        """Wait for news; returns events in order and the topics that changed."""
        await self._wake.wait()
        self._wake.clear()
        events, topics = list(self.pending), list(self.dirty)
        self.pending.clear()
        self.dirty.clear()
        return events, topics


class Hub:
    """Who looks, and how often each topic has changed."""

    def __init__(self) -> None:
        self.versions: Counter[str] = Counter()
        self._subscribers: set[Subscriber] = set()

    @property
    def watchers(self) -> int:
        """How many browsers look."""
        return len(self._subscribers)

    def join(self) -> Subscriber:
        """A browser comes."""
        subscriber = Subscriber()
        self._subscribers.add(subscriber)
        return subscriber

    def leave(self, subscriber: Subscriber) -> None:
        """A browser goes."""
        self._subscribers.discard(subscriber)

    def changed(self, topic: str) -> None:
        """The value behind a state topic is new."""
        self.versions[topic] += 1
        for subscriber in self._subscribers:
            subscriber.dirty[topic] = None
            subscriber.wake()

    def append(self, topic: str, item: Any) -> None:
        """An event that nobody may miss."""
        for subscriber in self._subscribers:
            if len(subscriber.pending) >= MAX_PENDING:
                subscriber.overflowed = True
            else:
                subscriber.pending.append((topic, item))
            subscriber.wake()
