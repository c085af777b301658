"""Rows of the audit: who did what."""

import json

from pydantic import Field, JsonValue

from iveg.domain.records import AuditRecord
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model


class AuditEntry(Model):
    """One row, with its place in the chain."""

    audit_id: str
    at: str
    person: str
    name: str
    role: str
    method: str
    action: str
    subject: str
    details: dict[str, JsonValue]
    seq: int = Field(description="Place in the chain, from 1 without a gap.")
    stored_at: str = Field(description="Long after `at`: the database was away.")
    previous_hash: str
    hash: str

    @classmethod
    def of_record(cls, record: AuditRecord) -> "AuditEntry":
        """As it was kept."""
        return cls(
            audit_id=record.audit_id,
            at=format_stamp(record.at),
            person=record.person,
            name=record.name,
            role=record.role,
            method=record.method,
            action=record.action,
            subject=record.subject,
            details=json.loads(record.details),
            seq=record.seq,
            stored_at=format_stamp(record.stored_at),
            previous_hash=record.previous_hash,
            hash=record.hash,
        )
