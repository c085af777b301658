"""A recorder whose disk has room, however full the machine's is."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.worker import Worker
from iveg.domain.retention import DiskSpace
from iveg.settings import Settings
from iveg.vital.ports import Clock

ROOMY = DiskSpace(free=10**12, total=10**12)
LIMITS = Settings().limits_of_recordings


class ThreadWorker(Worker):
    """Works in a thread, as no test waits for a process."""

    def _ask(self, work: Any, args: Any, kwargs: Any) -> Any:
        return work(*args, **kwargs)


def roomy(_: Path) -> DiskSpace:
    return ROOMY


def input_recorder(
    folder: Path, clock: Clock, read_space: Callable[[Path], DiskSpace] = roomy
) -> InputRecorder:
    return InputRecorder(folder, clock, LIMITS, read_space, ThreadWorker())
