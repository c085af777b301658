"""Feeds the live door for Foxglove beside the loop: one bounded queue, one process.

The loop packs an input where somebody looks on, and no more; the newest win.
"""

import asyncio
from asyncio.subprocess import Process
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import NoReturn

import orjson

from iveg.adapters.extras import require_extra
from iveg.adapters.recordings.fed_process import FedProcess
from iveg.adapters.recordings.incoming import Sort, pack
from iveg.domain.errors import HopError
from iveg.domain.observations import Instant

PART = "foxglove"
HOST = "127.0.0.1"
MOST_WAITING = 500
FEED_S = 0.1


@dataclass(frozen=True)
class DoorSetup:
    """What the process is told at its beginning.

    Attributes:
        port: On ``HOST``.
        apikey: First part of every measure topic.
        robots: The fleet.
    """

    port: int
    apikey: str = "iveg"
    robots: Sequence[str] = ()

    def line(self) -> bytes:
        """For its standard input."""
        return orjson.dumps(asdict(self)) + b"\n"


class LiveFeed:
    """Its methods are called in the loop and never wait.

    Args:
        setup: Of the process (``live_door``).

    Attributes:
        counters: Inputs ``foxglove_dropped``: newer ones came before they were shown.
        subscriptions: Of all who look on.
    """

    def __init__(self, setup: DoorSetup) -> None:
        require_extra(PART, "IVEG_FOXGLOVE")
        self.counters: Counter[str] = Counter()
        self.subscriptions = 0
        self._setup = setup
        self._waiting: deque[bytes] = deque(maxlen=MOST_WAITING)

    def measure(self, topic: str, payload: bytes, at: Instant) -> None:
        """A robot's own message, read from the broker."""
        self._show(Sort.MEASURE, at, topic, payload)

    def notification(self, body: bytes, at: Instant) -> None:
        """A notification of Orion's."""
        self._show(Sort.NOTIFICATION, at, "", body)

    def _show(self, sort: Sort, at: Instant, name: str, payload: bytes) -> None:
        if self.subscriptions:
            self.counters["foxglove_dropped"] += len(self._waiting) == MOST_WAITING
            self._waiting.append(pack(sort, at, name, payload))

    @property
    def waiting(self) -> int:
        """Inputs that wait for the process."""
        return len(self._waiting)

    async def run(self) -> NoReturn:
        """Until cancelled.

        Raises:
            HopError: the process ended, or its port cannot be had.
        """
        door = await _start(self._setup.line(), self._looked_on)
        feed = asyncio.create_task(self._feed(door), name="foxglove-feed")
        try:
            await door.listen()
        finally:
            self._looked_on(0)
            feed.cancel()
            await asyncio.gather(feed, return_exceptions=True)
            await door.end()

    async def _feed(self, door: "DoorProcess") -> NoReturn:
        while True:
            await asyncio.sleep(FEED_S)
            waiting = list(self._waiting)
            self._waiting.clear()
            await door.feed(waiting)

    def _looked_on(self, subscriptions: int) -> None:
        self.subscriptions = subscriptions
        if not subscriptions:
            self._waiting.clear()


class DoorProcess(FedProcess):
    """The process of the door."""

    MODULE = "iveg.adapters.recordings.live_door"
    NAME = REFUSER = PART

    def __init__(self, process: Process, looked_on: Callable[[int], None]) -> None:
        super().__init__(process)
        self._looked_on = looked_on

    def heard(self, counts: dict[str, int]) -> None:
        """Somebody came to look on, or left."""
        self._looked_on(counts["subscriptions"])


async def _start(setup: bytes, looked_on: Callable[[int], None]) -> DoorProcess:
    try:
        return await DoorProcess.spawn(setup, looked_on)
    except OSError as error:
        raise HopError(PART, error.strerror or str(error)) from error
