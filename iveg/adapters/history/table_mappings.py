"""Which record is a row of which table."""

from dataclasses import dataclass

from sqlalchemy import Table

from iveg.adapters.history.tables import (
    alerts,
    audit,
    climate,
    command_events,
    commands,
    decisions,
    detections,
    latency,
    log,
    measurements,
    odometry,
    readings,
)
from iveg.domain.records import (
    AlertRecord,
    AuditRecord,
    ClimateRecord,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LatencyRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
)


@dataclass(frozen=True, slots=True)
class TableMapping:
    """Table of one kind of record.

    Attributes:
        identity: Columns that name the thing or fact; empty where every row is new.
        changes: Whether a later record takes the place of an earlier one.
        keep_s: How long before the newest a row is kept (s, by ``at``); None: for good.
    """

    table: Table
    identity: tuple[str, ...] = ()
    changes: bool = False
    keep_s: float | None = None


TABLE_MAPPINGS: dict[type, TableMapping] = {
    CommandRecord: TableMapping(commands, ("command_id",), changes=True),
    CommandEventRecord: TableMapping(
        command_events, ("command_id", "at", "state", "why")
    ),
    DecisionRecord: TableMapping(decisions, ("decision_id",), changes=True),
    AlertRecord: TableMapping(alerts, ("alert_id",), changes=True),
    LogRecord: TableMapping(log, ("id", "at")),
    DetectionRecord: TableMapping(detections),
    OdometryRecord: TableMapping(odometry),
    ClimateRecord: TableMapping(climate),
    LatencyRecord: TableMapping(latency, keep_s=86400.0),
    ReadingRecord: TableMapping(readings),
    MeasurementRecord: TableMapping(measurements),
    AuditRecord: TableMapping(audit, ("audit_id",)),
}
