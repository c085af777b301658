"""Rows of the history: one frozen value each.

All times are Unix seconds UTC, positions are in ``map`` (m), speeds in m/s and rad/s.
A decision, a command and an alert change state: a later record with the same id takes
the place of the earlier one.  The other records are facts that are only ever added.
``Json`` is what JSON can hold; the history keeps it as such, not as text.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from iveg.domain.transports import TransportId

Json = Mapping[str, Any]
"""An object."""
ByTransport = Mapping[TransportId, float]
"""A time for each transport that has one (Unix s)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DecisionRecord:
    """Cause and consequences of an alert or speed limit (docs/dashboard.md).

    Attributes:
        kind: ``alert`` (somebody was confirmed) or ``mandate`` (a robot was told).
        robot_id: The robot that was told; for an alert its observer.
        class_: Canonical (``person``, ``robot``); ``class_id`` as the detector said.
        confidence: 0 to 1.
        distance_m: From the robot to the centre of the ring (m).
        speed_factor: What was limited to: 0, 0.5 or 1.
        rule_parameters: The rule's parameters at that moment.
        in_sight: Whether the robot itself could see the cause; None when unknown.
        started_at: When the rule fired; ``ended_at`` when it let go.
        observed_at: When the speed had come down.
        speed_before: Measured at ``started_at`` (m/s);
            ``speed_after`` at ``observed_at``.
        links: Each ``{"link", "at", "value", "verdict"}``.
    """

    decision_id: str
    kind: Literal["alert", "mandate"]
    robot_id: str
    started_at: float
    person_id: str | None = None
    observer: str | None = None
    class_: str | None = None
    class_id: str | None = None
    confidence: float | None = None
    x: float | None = None
    y: float | None = None
    z: float | None = None
    distance_m: float | None = None
    speed_factor: float | None = None
    reason: str | None = None
    rule_id: str | None = None
    rule_version: str | None = None
    rule_parameters: Json = field(default_factory=dict)
    in_sight: bool | None = None
    feedback_at: float | None = None
    applied_at: float | None = None
    observed_at: float | None = None
    ended_at: float | None = None
    speed_before: float | None = None
    speed_after: float | None = None
    links: Sequence[Json] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRecord:
    """One box of one detection frame of one robot.

    Attributes:
        at: When it reached iVeg.
        stamp: The robot's clock, exactly as sent.
        class_: Canonical; None for a class that the alias table does not know.
        x, y, z: None where the place is no longer kept (``retention.py``).
        confident: Whether it reached the threshold.
        transport: Id of the transport whose copy was first.
        box: The box with its ``frame_id``; None when it was not kept.
    """

    at: float
    robot_id: str
    class_id: str
    probability: float
    x: float | None = None
    y: float | None = None
    z: float | None = None
    confident: bool
    transport: str
    stamp: str | None = None
    class_: str | None = None
    person_id: str | None = None
    box: Json | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandRecord:
    """One STOP, release, resume or goal as it stands now.

    Attributes:
        state: One of the nine states of the STOP machine, RUNNING at the end of a
            STOP, REPLACED or EXPIRED where another command took over; of a goal one of
            ``domain.goals``.
        sent_at: When each transport first took it; ``answer_at`` when the robot first
            said by it that it has it.
        standing_at: First standing sample.
        standstill_ms: ``standing_at`` − the press, or ``requested_at`` without (ms).
        tries: How often it was sent.
        reason: A code for what is shown beside the state.
        pressed_at: When a finger pressed, by the browser's corrected clock (Unix s).
        goal: Of a goal its ``{"kind", "x", "y", "aisle"}``, in ``map`` (m).
    """

    command_id: str
    robot_id: str
    kind: Literal["stop", "release", "resume", "goal"]
    state: str
    requested_by: str
    requested_at: float
    sent_at: ByTransport = field(default_factory=dict)
    answer_at: ByTransport = field(default_factory=dict)
    standing_at: float | None = None
    standstill_ms: float | None = None
    tries: int = 0
    reason: str | None = None
    pressed_at: float | None = None
    goal: Json | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandEventRecord:
    """One change of one command: a line of the audit trail, never altered."""

    command_id: str
    robot_id: str
    at: float
    state: str
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class AlertRecord:
    """One alert to people, through its life (ISA-18.2).

    Attributes:
        priority: ``P1``, ``P2`` or ``P3``.
        key: Template of its sentence; ``slots`` fill it.
        raised_at: The first time; ``last_raised_at`` the newest.
        count: How often it was raised while it lived.
    """

    alert_id: str
    priority: str
    key: str
    raised_at: float
    last_raised_at: float
    slots: Json = field(default_factory=dict)
    robot_id: str | None = None
    cleared_at: float | None = None
    acknowledged_at: float | None = None
    acknowledged_by: str | None = None
    note: str | None = None
    count: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class LogRecord:
    """One line of the action and inference log.

    Attributes:
        id: The live log's number.
        key: Template of its sentence; ``slots`` fill it.
    """

    id: int
    at: float
    kind: str
    key: str
    slots: Json = field(default_factory=dict)
    robot_id: str | None = None
    class_: str | None = None
    decision_id: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryRecord:
    """Pose and speed of a robot, with its speed limit and the applied factor.

    Attributes:
        linear: (m/s); ``angular`` (rad/s).
        limit_factor: iVeg's speed limit; ``applied_factor`` the robot's report.
        link: ``LIVE``, ``LATE`` or ``LOST``.
        margin_m: Least margin to anybody who is seen, while it moves (m; at most a
            second old); None where it is unknown or there is none.
    """

    at: float
    robot_id: str
    x: float
    y: float
    yaw: float
    linear: float
    angular: float
    limit_factor: float
    applied_factor: float | None = None
    link: str | None = None
    margin_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ClimateRecord:
    """One reading of the air in the greenhouse; None where a sensor was silent.

    Attributes:
        temperature: (°C); ``relative_humidity`` 0 to 1; ``co2`` (ppm).
    """

    at: float
    temperature: float | None = None
    relative_humidity: float | None = None
    co2: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingRecord:
    """One reading of a small sensor of one robot.

    Attributes:
        kind: Name of the observation in lower case, such as ``battery``.
        value: Its fields by name.
    """

    at: float
    robot_id: str
    kind: str
    value: Mapping[str, float | str | bool | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementRecord:
    """One number of other equipment, as its tile shows it.

    Attributes:
        unit: Of the tile at that time (``domain.equipment.UNITS``).
    """

    at: float
    entity_id: str
    attribute: str
    value: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditRecord:
    """Who did what, to what: a row of the audit, never changed (``domain.audit``).

    Attributes:
        audit_id: Its own; a row that is offered twice is stored once.
        at: When it happened.
        person: Id of the account; ``name``, ``role`` and ``method`` (of signing in)
            as they were then.
        action: Such as ``stop`` or ``sign_in_refused``.
        subject: What it was done to, such as a robot's id.
        details: JSON.
    """

    audit_id: str
    at: float
    person: str
    name: str
    role: str
    method: str
    action: str
    subject: str = ""
    details: str = "{}"


Record = (
    DecisionRecord
    | DetectionRecord
    | CommandRecord
    | CommandEventRecord
    | AlertRecord
    | LogRecord
    | OdometryRecord
    | ClimateRecord
    | ReadingRecord
    | MeasurementRecord
    | AuditRecord
)
RECORD_TYPES: tuple[type[Record], ...] = (
    DecisionRecord,
    DetectionRecord,
    CommandRecord,
    CommandEventRecord,
    AlertRecord,
    LogRecord,
    OdometryRecord,
    ClimateRecord,
    ReadingRecord,
    MeasurementRecord,
    AuditRecord,
)


def is_telemetry(record: Record) -> bool:
    """Whether a record is dropped first under pressure."""
    return isinstance(
        record,
        OdometryRecord
        | DetectionRecord
        | ClimateRecord
        | ReadingRecord
        | MeasurementRecord,
    )


def is_order(record: Record) -> bool:
    """Whether a record is of an order: in the journal, and never dropped."""
    return isinstance(record, CommandRecord | CommandEventRecord)
