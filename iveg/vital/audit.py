"""The one port by which the audit is written: an event in, a row on its way.

It never waits: rows go the way of the history, so that a STOP works where the disk is
full or the database away, and the row that comes late says so.
"""

from iveg.domain.audit import Actor, act_of
from iveg.domain.observations import Instant
from iveg.domain.records import Json
from iveg.vital.ports import Ids
from iveg.vital.record import RecordSink


class AuditTrail:
    """Writes down who did what.

    Args:
        sink: The history's recorder.
        new_id: Ids of rows.
    """

    def __init__(self, sink: RecordSink, new_id: Ids) -> None:
        self._sink = sink
        self._new_id = new_id

    def note(
        self,
        actor: Actor,
        action: str,
        subject: str = "",
        details: Json | None = None,
        *,
        at: Instant,
    ) -> None:
        """Write one act down; returns at once."""
        act = act_of(
            actor, action, subject, details or {}, audit_id=self._new_id(), at=at.wall
        )
        self._sink.enqueue(act)
