"""Records for tests: everything has a default, override what matters."""

from typing import Any

from iveg.domain.records import (
    AlertRecord,
    AuditRecord,
    ClimateRecord,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
)

NOON = 1_700_000_000.0
"""2023-11-14T22:13:20Z."""


def odometry_record(**fields: Any) -> OdometryRecord:
    defaults: dict[str, Any] = {
        "at": NOON,
        "robot_id": "AGI",
        "x": 1.0,
        "y": 2.0,
        "yaw": 0.5,
        "linear": 0.5,
        "angular": 0.0,
        "limit_factor": 1.0,
        "applied_factor": 1.0,
        "link": "LIVE",
    }
    return OdometryRecord(**(defaults | fields))


def audit_record(**fields: Any) -> AuditRecord:
    defaults: dict[str, Any] = {
        "audit_id": "A1",
        "at": NOON,
        "person": "P1",
        "name": "Ana Núñez",
        "role": "operator",
        "method": "link",
        "action": "stop",
        "subject": "AGI",
        "details": '{"status":202}',
    }
    return AuditRecord(**(defaults | fields))


def climate_record(**fields: Any) -> ClimateRecord:
    defaults: dict[str, Any] = {
        "at": NOON,
        "temperature": 21.5,
        "relative_humidity": 0.7,
        "co2": 430.0,
    }
    return ClimateRecord(**(defaults | fields))


def detection_record(**fields: Any) -> DetectionRecord:
    defaults: dict[str, Any] = {
        "at": NOON,
        "robot_id": "AGI",
        "stamp": "2023-11-14T22:13:19.900Z",
        "class_": "person",
        "class_id": "farmer",
        "probability": 0.94,
        "x": -3.5,
        "y": 2.0,
        "z": 0.9,
        "confident": True,
        "transport": "direct",
        "box": {
            "xmin": -4.0,
            "xmax": -3.0,
            "ymin": 1.5,
            "ymax": 2.5,
            "zmin": 0.0,
            "zmax": 1.8,
            "frame_id": "map",
        },
    }
    return DetectionRecord(**(defaults | fields))


def decision_record(**fields: Any) -> DecisionRecord:
    defaults: dict[str, Any] = {
        "decision_id": "D1",
        "kind": "mandate",
        "robot_id": "AGII",
        "started_at": NOON,
        "person_id": "P1",
        "observer": "AGI",
        "class_": "person",
        "class_id": "farmer",
        "confidence": 0.94,
        "x": 1.0,
        "y": 2.0,
        "z": 0.9,
        "distance_m": 1.43,
        "speed_factor": 0.5,
        "reason": "person",
        "rule_id": "ring",
        "rule_version": "1",
        "rule_parameters": {"radius_m": 2.0},
        "in_sight": False,
        "links": [
            {"link": "detection", "at": NOON, "value": "farmer", "verdict": "ok"}
        ],
    }
    return DecisionRecord(**(defaults | fields))


def command_record(**fields: Any) -> CommandRecord:
    defaults: dict[str, Any] = {
        "command_id": "C1",
        "robot_id": "AGI",
        "kind": "stop",
        "state": "REQUESTED",
        "requested_by": "ana",
        "requested_at": NOON,
    }
    return CommandRecord(**(defaults | fields))


def command_event_record(**fields: Any) -> CommandEventRecord:
    defaults: dict[str, Any] = {
        "command_id": "C1",
        "robot_id": "AGI",
        "at": NOON,
        "state": "REQUESTED",
        "why": "press",
    }
    return CommandEventRecord(**(defaults | fields))


def alert_record(**fields: Any) -> AlertRecord:
    defaults: dict[str, Any] = {
        "alert_id": "A1",
        "priority": "P2",
        "key": "alert.person_slowed",
        "raised_at": NOON,
        "last_raised_at": NOON,
        "slots": {"robot": "AGI"},
        "robot_id": "AGI",
    }
    return AlertRecord(**(defaults | fields))


def log_record(**fields: Any) -> LogRecord:
    defaults: dict[str, Any] = {
        "id": 1,
        "at": NOON,
        "kind": "speed",
        "key": "log.speed_up",
        "slots": {"robot": "AGI"},
        "robot_id": "AGI",
    }
    return LogRecord(**(defaults | fields))


def measurement_record(**fields: Any) -> MeasurementRecord:
    """One number of other equipment."""
    given: dict[str, Any] = {
        "at": NOON,
        "entity_id": "unit",
        "attribute": "flow",
        "value": 18.5,
        "unit": "L/min",
    }
    return MeasurementRecord(**given | fields)
