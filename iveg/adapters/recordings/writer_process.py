"""The process that writes recordings, as its feeder sees it."""

from asyncio.subprocess import Process
from collections import Counter
from collections.abc import Iterable

from iveg.adapters.recordings.fed_process import FedProcess
from iveg.adapters.recordings.writer import WriterSetup


class WriterProcess(FedProcess):
    """One process, from its start to its end.

    Args:
        process: Just started, with pipes.
        counters: Gets ``recordings_written`` inputs, and ``recordings_dropped``: those
            that it refused, or had not kept when it ended.
    """

    MODULE = "iveg.adapters.recordings.writer"
    NAME = "recordings"
    REFUSER = "disk"

    def __init__(self, process: Process, counters: Counter[str]) -> None:
        super().__init__(process)
        self._counters = counters
        self._handed = 0
        self._answered: Counter[str] = Counter()

    @classmethod
    async def start(cls, setup: WriterSetup, counters: Counter[str]) -> "WriterProcess":
        """Start one.  Raises OSError."""
        return await cls.spawn(setup.line(), counters)

    async def feed(self, packed: Iterable[bytes]) -> None:
        """Hand over inputs, and count them."""
        inputs = list(packed)
        self._handed += len(inputs)
        await super().feed(inputs)

    def heard(self, counts: dict[str, int]) -> None:
        """What became of inputs since it began."""
        fresh = Counter(counts) - self._answered
        self._answered = Counter(counts)
        for what, count in fresh.items():
            self._counters[f"recordings_{what}"] += count

    def ended(self) -> None:
        """What it had not kept is lost."""
        lost = self._handed - self._answered.total()
        self._handed -= lost
        self._counters["recordings_dropped"] += lost
