"""A recorder that remembers in a list."""

from iveg.domain.records import Record


class FakeRecorder:
    """Stands in for ``RecordSink``; ``records`` holds what was offered, in order."""

    def __init__(self) -> None:
        self.records: list[Record] = []

    def offer(self, record: Record) -> None:
        self.records.append(record)
