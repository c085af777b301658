"""Rows of the history, recorded on their way."""

from collections.abc import Callable

from iveg.domain.records import Record
from iveg.pipeline.record import RecordSink


class RecordedSink:
    """The history's recorder, whose rows are recorded here, too.

    Implements ``pipeline.record.RecordSink``.
    """

    def __init__(self, history: RecordSink, row: Callable[[Record], None]) -> None:
        self._history, self._row = history, row
        self.flushed = history.flushed

    def enqueue(self, record: Record) -> None:
        """Queue a record in both."""
        self._history.enqueue(record)
        self._row(record)
