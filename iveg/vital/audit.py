"""Port of the audit: takes an act and queues its row.

It never waits for the history, so a STOP works with a full disk or without a database.
A row keeps the time of its act, however late it is stored.
"""

import json

from iveg.domain.audit import Actor
from iveg.domain.observations import Instant
from iveg.domain.records import AuditRecord, Json
from iveg.vital.ports import Ids
from iveg.vital.record import RecordSink


class AuditTrail:
    """Writes acts and their actors to the audit.

    Args:
        sink: The history's recorder.
        new_id: Ids of rows.
    """

    def __init__(self, sink: RecordSink, new_id: Ids) -> None:
        self._sink, self._new_id = sink, new_id

    def note(
        self,
        actor: Actor,
        action: str,
        subject: str = "",
        details: Json | None = None,
        *,
        at: Instant,
    ) -> None:
        """Queue the row of one act; returns at once."""
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
