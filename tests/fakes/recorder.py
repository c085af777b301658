"""A recorder that remembers in a list, on a disk that can hang."""

import asyncio

from iveg.domain.records import Record


class FakeRecorder:
    """Stands in for ``RecordSink``; ``records`` holds what was offered, in order.

    Attributes:
        durable: What would outlive a crash.
        opened: Cleared, the disk hangs until it is set.
        mistake: Raised by everything, where it is set.
    """

    def __init__(self) -> None:
        self.records: list[Record] = []
        self.durable: list[Record] = []
        self.opened = asyncio.Event()
        self.opened.set()
        self.mistake: Exception | None = None

    def enqueue(self, record: Record) -> None:
        if self.mistake is not None:
            raise self.mistake
        self.records.append(record)

    async def flushed(self) -> None:
        if self.mistake is not None:
            raise self.mistake
        now = list(self.records)
        await self.opened.wait()
        if len(now) > len(self.durable):
            self.durable = now
