"""The one port by which the audit is written: an act in, a row on its way.

It never waits: rows go the way of the history, so that a STOP works where the disk is
full or the database away, and the row that comes late says so.
"""

import json

from iveg.domain.audit import Actor
from iveg.domain.observations import Instant
from iveg.domain.records import AuditRecord, Json
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
        self._sink.enqueue(
            AuditRecord(
                audit_id=self._new_id(),
                at=at.wall,
                person=actor.person,
                name=actor.name,
                role=actor.role,
                method=actor.method,
                action=action,
                subject=subject,
                details=json.dumps(
                    details or {}, sort_keys=True, separators=(",", ":")
                ),
            )
        )
