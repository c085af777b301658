"""Alerts (ISA-18.2).

A line of the log.

A person's note, pinned to a time and a place.

Rows of the audit: who did what.
"""

import json
from typing import cast

from pydantic import Field, JsonValue

from iveg.domain import alerts
from iveg.domain.alerts import write_alert
from iveg.domain.events import Priority
from iveg.domain.records import AlertRecord, AuditRecord, LogRecord
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, Slots, stamp


class Alert(Model):
    """An alert to people: all occurrences of one kind and subject as one.

    A notice to people (ISA-18.2). One condition (kind and subject) that is back within
    10 minutes is the same alert, once more; each time it sounds and asks to be
    acknowledged anew. A condition that gets graver is raised anew at once.

    Attributes:
        alert_id: The alert.
        priority: The gravest of what holds and of what nobody has acknowledged.
        key: Template of its sentence.
        slots: Values of its sentence.
        robot_id: Whom it is about.
        last_raised_at: First and newest time.
        cleared_at: Of the newest time.
        acknowledged_at: Of the newest time.
        acknowledged_by: Of the newest time.
        note: Of the newest time.
        count: How often it was raised.
    """

    alert_id: str
    priority: Priority
    key: str
    slots: Slots
    robot_id: str | None
    raised_at: str = Field(description="The first time; ``last_raised_at`` the newest.")
    last_raised_at: str
    cleared_at: str | None
    acknowledged_at: str | None
    acknowledged_by: str | None
    note: str | None
    count: int

    @classmethod
    def of(cls, alert: alerts.BookedAlert) -> "Alert":
        """One alert as it is now."""
        return cls.of_record(write_alert(alert))

    @classmethod
    def of_record(cls, record: AlertRecord) -> "Alert":
        """One alert as it is remembered."""
        return cls(
            alert_id=record.alert_id,
            priority=cast("Priority", record.priority),
            key=record.key,
            slots=dict(record.slots),
            robot_id=record.robot_id,
            raised_at=format_stamp(record.raised_at),
            last_raised_at=format_stamp(record.last_raised_at),
            cleared_at=stamp(record.cleared_at),
            acknowledged_at=stamp(record.acknowledged_at),
            acknowledged_by=record.acknowledged_by,
            note=record.note,
            count=record.count,
        )


class AcknowledgedAlerts(Model):
    """What became of alerts that somebody acknowledged together.

    Attributes:
        items: Those that this acknowledged.
    """

    items: list[Alert]
    left: list[str] = Field(
        description="Ids that were left: P1s, seen ones, and what is no longer there."
    )


class LogEntry(Model):
    """One line of the action and inference log.

    Attributes:
        id: Rises.
        at: When.
        kind: ``detection``, ``speed``, ``command``, ``link``, ``alert`` or ``system``.
        robot_id: Whom it is about.
        key: Template of its sentence.
        slots: Values of its sentence.
        class_: Canonical class.
        decision_id: The decision behind it.
    """

    id: int
    at: str
    kind: str
    robot_id: str | None
    key: str
    slots: Slots
    class_: str | None = Field(validation_alias="class", serialization_alias="class")
    decision_id: str | None

    @classmethod
    def of_record(cls, record: LogRecord) -> "LogEntry":
        """One line, live and remembered."""
        return cls(
            id=record.id,
            at=format_stamp(record.at),
            kind=record.kind,
            robot_id=record.robot_id,
            key=record.key,
            slots=dict(record.slots),
            class_=record.class_,
            decision_id=record.decision_id,
        )


class Note(Model):
    """What somebody wrote about a moment; nobody can change it.

    Attributes:
        note_id: Number of its line in the log.
        at: Moment that it is about.
        written_at: When it was written.
        by: Who.
        text: What.
        x: Place in ``map``, if it has one (m).
        y: Place in ``map``, if it has one (m).
        robot_id: Robot.
        decision_id: Decision.
    """

    note_id: int
    at: str | None
    written_at: str | None
    by: str
    text: str
    x: float | None
    y: float | None
    robot_id: str | None
    decision_id: str | None

    @classmethod
    def of_record(cls, line: LogRecord) -> "Note":
        """Of its line in the log."""
        slots = line.slots
        return cls(
            note_id=line.id,
            at=stamp(slots.get("pinned_at", line.at)),
            written_at=stamp(line.at),
            by=slots.get("by", ""),
            text=slots.get("text", ""),
            x=slots.get("x"),
            y=slots.get("y"),
            robot_id=line.robot_id,
            decision_id=line.decision_id,
        )


class AuditEntry(Model):
    """One row.

    Attributes:
        audit_id: Its own.
        at: When it happened.
        person: Id of the account.
        name: Of the account, as it was then.
        role: As it was then.
        method: Way of signing in.
        action: Such as ``stop``, ``release``, ``rule``, ``sign_in_refused``,
            ``export``.
        subject: What it was done to, such as a robot's id; may be empty.
        details: ``status`` of the answer, and what was asked; of a rule
            ``version_seen`` and the new ``version``.
    """

    audit_id: str
    at: str
    person: str
    name: str
    role: str
    method: str
    action: str
    subject: str
    details: dict[str, JsonValue]

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
        )
