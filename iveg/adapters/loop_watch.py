"""Measures the turns of the loop: how much CPU each takes, and whose the long ones are.

A beat comes due every 20 ms.  What it finds late was held up by one turn, whose CPU is
that of the loop's thread since the beat before, less those 20 ms at most: time in which
the machine did something else does not count.  A thread looks meanwhile what runs.
"""

import asyncio
import sys
import threading
from collections.abc import Callable
from types import FrameType

from iveg.adapters import clock

BEAT_S = 0.02
_LOOK_S = 0.1
_OVERDUE_S = 0.1
"""A beat that is so late is held up by a turn worth a look."""
_UNKNOWN = "?"


class LoopWatch:
    """Reports each turn that was longer than a beat.

    Args:
        note: Called with the part whose turn it was, and the CPU that it took (s).
        read_mono: Reads the monotonic clock (s).
        read_cpu: Reads the CPU that the calling thread has used (s).
    """

    def __init__(
        self,
        note: Callable[[str, float], None],
        read_mono: Callable[[], float] = clock.mono,
        read_cpu: Callable[[], float] = clock.thread_cpu,
    ) -> None:
        self._note = note
        self._mono = read_mono
        self._cpu = read_cpu
        self._beat_at = self._cpu_at = 0.0
        self._part = _UNKNOWN
        self._ended = threading.Event()

    async def run(self) -> None:
        """Until cancelled."""
        self._ended = threading.Event()
        self._begin()
        about = asyncio.get_running_loop(), threading.get_ident(), self._ended
        threading.Thread(
            target=self._look, args=about, name="loop-watch", daemon=True
        ).start()
        try:
            while True:
                await asyncio.sleep(BEAT_S)
                self.beat()
        finally:
            self._ended.set()

    def beat(self) -> None:
        """A beat has its turn."""
        cpu_s = self._cpu() - self._cpu_at - BEAT_S
        if cpu_s > 0.0:
            self._note(self._part, cpu_s)
        self._begin()

    def _begin(self) -> None:
        self._part = _UNKNOWN
        self._beat_at, self._cpu_at = self._mono(), self._cpu()

    # --- in the thread that looks ---------------------------------------------------

    def _look(
        self, loop: asyncio.AbstractEventLoop, thread: int, ended: threading.Event
    ) -> None:
        while not ended.wait(_LOOK_S):
            if self._mono() - self._beat_at > BEAT_S + _OVERDUE_S:
                # A loop that only waits for its next beat has no name to give.
                self._part = _running(loop, thread) or self._part


def _running(loop: asyncio.AbstractEventLoop, thread: int) -> str | None:
    """Name of the task that the loop runs, or of the module where it has none."""
    task = asyncio.current_task(loop)
    if task is not None and not task.get_name().startswith("Task-"):
        return task.get_name()
    return _module_of(sys._current_frames().get(thread))


def _module_of(frame: FrameType | None) -> str | None:
    """The innermost module of iVeg on a stack, without the package's name."""
    while frame is not None:
        module = str(frame.f_globals.get("__name__", ""))
        if module.startswith("iveg."):
            return module.removeprefix("iveg.")
        frame = frame.f_back
    return None
