"""The lists of the history: which records each has, and how it is sorted."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from sqlalchemy import Column, ColumnElement, Table

from iveg.adapters.history import tables
from iveg.domain.records import (
    AlertRecord,
    AuditRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
    Record,
)

R = TypeVar("R", bound=Record)


@dataclass(frozen=True, slots=True)
class ListOf(Generic[R]):
    """Listing of one kind of record.

    Attributes:
        at: The column that orders it; ``key`` settles equal times.
        classes: Columns that the class filter looks at.
        which: Rows that are in the list at all; None: every one of the table.
        sorts: Columns that it can be sorted by beside its time, by name.
    """

    kind: type[R]
    table: Table
    at: Column[float]
    key: Column[int] | Column[str]
    classes: tuple[Column[str], ...] = ()
    probability: Column[float] | None = None
    which: ColumnElement[bool] | None = None
    sorts: Mapping[str, Column[str]] = field(default_factory=dict)


DECISIONS = ListOf(
    DecisionRecord,
    tables.decisions,
    tables.decisions.c.started_at,
    tables.decisions.c.decision_id,
    (tables.decisions.c.class_, tables.decisions.c.class_id),
    tables.decisions.c.confidence,
    sorts={"robot": tables.decisions.c.robot_id},
)


DETECTIONS = ListOf(
    DetectionRecord,
    tables.detections,
    tables.detections.c.at,
    tables.detections.c.row_id,
    (tables.detections.c.class_, tables.detections.c.class_id),
    tables.detections.c.probability,
)


TRACKS = replace(DETECTIONS, which=tables.detections.c.person_id.is_not(None))


ODOMETRY = ListOf(
    OdometryRecord,
    tables.odometry,
    tables.odometry.c.at,
    tables.odometry.c.row_id,
)


COMMANDS = ListOf(
    CommandRecord,
    tables.commands,
    tables.commands.c.requested_at,
    tables.commands.c.command_id,
    sorts={"robot": tables.commands.c.robot_id, "kind": tables.commands.c.kind},
)


ALERTS = ListOf(
    AlertRecord,
    tables.alerts,
    tables.alerts.c.last_raised_at,
    tables.alerts.c.alert_id,
    sorts={"robot": tables.alerts.c.robot_id, "priority": tables.alerts.c.priority},
)


LOG = ListOf(
    LogRecord,
    tables.log,
    tables.log.c.at,
    tables.log.c.row_id,
    (tables.log.c.class_,),
    sorts={"robot": tables.log.c.robot_id, "kind": tables.log.c.kind},
)


NOTE = "log.note"


NOTES = replace(LOG, which=tables.log.c.key == NOTE)


READINGS = ListOf(
    ReadingRecord,
    tables.readings,
    tables.readings.c.at,
    tables.readings.c.row_id,
    (tables.readings.c.kind,),
)


MEASUREMENTS = ListOf(
    MeasurementRecord,
    tables.measurements,
    tables.measurements.c.at,
    tables.measurements.c.row_id,
    (tables.measurements.c.entity_id, tables.measurements.c.attribute),
)


AUDIT = ListOf(
    AuditRecord,
    tables.audit,
    tables.audit.c.at,
    tables.audit.c.seq,
    (tables.audit.c.action, tables.audit.c.name),
)
