"""A thread that waits for data of DDS and wakes the event loop."""

import asyncio
import threading
from collections.abc import Callable, Iterable

from cyclonedds.core import (
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import DomainParticipant
from cyclonedds.util import duration

from iveg.adapters.dds_entities import DdsReader

_WAIT_MS = 250
_REARM_S = 0.002


class DdsWatch:
    """A thread that waits for data and wakes the loop, which takes them."""

    def __init__(
        self,
        participant: DomainParticipant,
        readers: Iterable[DdsReader],
        loop: asyncio.AbstractEventLoop,
        on_data: Callable[[], None],
    ) -> None:
        self._waitset = WaitSet(participant)
        mask = SampleState.NotRead | ViewState.Any | InstanceState.Any
        self._conditions = [ReadCondition(one.entity, mask) for one in readers]
        for condition in self._conditions:
            self._waitset.attach(condition)
        self._loop, self._on_data = loop, on_data
        self._ended = threading.Event()
        # Nobody lets go of it: to wait for it is the cheapest rest.
        self._rest = threading.Lock()
        self._rest.acquire()
        self._is_announced = False
        self._thread = threading.Thread(target=self._wait, name="dds", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._ended.set()
        self._thread.join()

    def _wait(self) -> None:
        while not self._ended.is_set():
            if not self._waitset.wait(duration(milliseconds=_WAIT_MS)):
                continue
            if not self._is_announced:
                self._is_announced = True
                try:
                    self._loop.call_soon_threadsafe(self._tell)
                except RuntimeError:  # the loop has closed
                    return
            # The loop takes what came meanwhile; a flood wakes it no more often.
            self._rest.acquire(timeout=_REARM_S)

    def _tell(self) -> None:
        # First, so that a sample which on_data just misses is announced again.
        self._is_announced = False
        if not self._ended.is_set():
            self._on_data()
