"""Rows of the history: one frozen value for each, declared once.

Each column is declared with its meaning.  From these declarations follow the tables
(``adapters.history.tables``), the keys of REST and NDJSON (``models``), the columns of
CSV and their page (``models.dictionary``).

All times are Unix seconds UTC, positions are in ``map`` (m), speeds in m/s and rad/s.
A decision, a command and an alert change their state: a later record with the same id
replaces the earlier record.  All other records are facts, which are only added.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import UnionType
from typing import (
    Annotated,
    Any,
    Final,
    Literal,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from iveg.domain.transports import TRANSPORTS, TransportId

Json = Mapping[str, Any]
"""JSON object; the history stores it as JSON and not as text."""
ByTransport = Mapping[TransportId, float]
"""Time by transport (Unix s); a transport without a time is absent."""


@dataclass(frozen=True, slots=True)
class Means:
    """Meaning of a column.

    Attributes:
        means: Meaning in one sentence.
        unit: Its unit; empty: none.
        frame: Frame of its coordinates; empty: no place.
        clock: Clock of its times; empty: no time.
        joins: Columns of other lists that it joins.
    """

    means: str
    unit: str = ""
    frame: str = ""
    clock: str = ""
    joins: str = ""


def _time(means: str, clock: str = "iVeg") -> Means:
    return Means(means, clock=clock)


_AT_THAT_TIME = "odometry: the newest `at` not after it, of the same `robot_id`"
_Robot = Annotated[str, Means("The robot.", joins=_AT_THAT_TIME)]
_RobotIfAny = Annotated[
    str | None, Means("The robot, if it is about one.", joins=_AT_THAT_TIME)
]
_Person = Annotated[
    str | None, Means("The track.", joins="decisions, detections, tracks: `person_id`")
]
_Class = Annotated[
    str | None, Means("Canonical class; none: unknown to the table of classes.")
]
_CLASS_ID = Means("Class as the detector said.")
_CONFIDENCE = Means("Confidence of the detection.", "0 to 1")
_Place = Annotated[
    float | None,
    Means(
        "Place of what was seen or judged; none where it is no longer kept.", "m", "map"
    ),
]
_Reason = Annotated[str | None, Means("Reason, as a code (docs/interfaces).")]
_Key = Annotated[str, Means("Template of its sentence; `slots` fill it.")]
_Slots = Annotated[Json, Means("Values of its sentence.")]
_Arrived = Annotated[float, _time("It reached iVeg.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class DecisionRecord:
    """Cause and consequences of an alert or speed limit (docs/dashboard.md)."""

    decision_id: Annotated[
        str, Means("The decision (ULID).", joins="decisions, log: `decision_id`")
    ]
    kind: Annotated[
        Literal["alert", "mandate"],
        Means("`alert` (somebody was confirmed) or `mandate` (a speed limit)."),
    ]
    robot_id: Annotated[
        str, Means("Robot that was limited, or saw.", joins=_AT_THAT_TIME)
    ]
    started_at: Annotated[float, _time("The rule fired.")]
    person_id: _Person = None
    observer: Annotated[
        str | None, Means("Robot that saw it.", joins="`robot_id` of other lists")
    ] = None
    class_: _Class = None
    class_id: Annotated[str | None, _CLASS_ID] = None
    confidence: Annotated[float | None, _CONFIDENCE] = None
    x: _Place = None
    y: _Place = None
    z: _Place = None
    distance_m: Annotated[
        float | None, Means("From the robot to the centre of the zone.", "m")
    ] = None
    speed_factor: Annotated[float | None, Means("The limit.", "0, 0.5 or 1")] = None
    reason: _Reason = None
    rule_id: Annotated[str | None, Means("The rule.")] = None
    rule_version: Annotated[
        str | None, Means("Its version.", joins="GET /rule/versions: `version`")
    ] = None
    rule_parameters: Annotated[
        Json, Means("Its parameters at that moment, with `places`.")
    ] = field(default_factory=dict)
    in_sight: Annotated[
        bool | None, Means("Whether the robot itself could see the cause.")
    ] = None
    feedback_at: Annotated[float | None, _time("The feedback left.")] = None
    applied_at: Annotated[float | None, _time("The robot reported the factor.")] = None
    observed_at: Annotated[float | None, _time("The speed had come down.")] = None
    ended_at: Annotated[float | None, _time("The rule let go; none: not yet.")] = None
    speed_before: Annotated[
        float | None, Means("Speed measured at `started_at`.", "m/s")
    ] = None
    speed_after: Annotated[float | None, Means("Speed at `observed_at`.", "m/s")] = None
    links: Annotated[
        Sequence[Json], Means("Links of the chain, each with time, value and verdict.")
    ] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRecord:
    """One box of one detection frame of one robot."""

    at: _Arrived
    robot_id: _Robot
    class_id: Annotated[str, _CLASS_ID]
    probability: Annotated[float, _CONFIDENCE]
    x: _Place = None
    y: _Place = None
    z: _Place = None
    confident: Annotated[
        bool, Means("Whether it reached the threshold of the rule in force.")
    ]
    transport: Annotated[
        str, Means("Transport whose copy was first: `direct` or `fiware`.")
    ]
    stamp: Annotated[
        str | None, _time("Time of the picture as the robot sent it.", "robot")
    ] = None
    class_: _Class = None
    person_id: _Person = None
    box: Annotated[
        Json | None, Means("The box as sent, with its `frame_id`.", "m", "its own")
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandRecord:
    """One STOP, release, resume or goal in its present state.

    The state of a STOP is one of the nine of its machine, or RUNNING at its end.  A
    command that another one took over is REPLACED or EXPIRED.  A goal has the states of
    ``domain.goals``.
    """

    command_id: Annotated[
        str, Means("The order (ULID).", joins="GET /commands/{id} has its steps")
    ]
    robot_id: _Robot
    kind: Annotated[
        Literal["stop", "release", "resume", "goal"], Means("Kind of the order.")
    ]
    state: Annotated[
        str,
        Means("One of the nine states of STOP, `RUNNING`, `REPLACED` or `EXPIRED`."),
    ]
    requested_by: Annotated[str, Means("Person who gave it first.")]
    requested_at: Annotated[float, _time("iVeg took the order.")]
    sent_at: Annotated[ByTransport, _time("This transport first took it.")] = field(
        default_factory=dict
    )
    answer_at: Annotated[
        ByTransport, _time("The robot first said by it that it has it.")
    ] = field(default_factory=dict)
    standing_at: Annotated[float | None, _time("First sample at rest.")] = None
    standstill_ms: Annotated[
        float | None, Means("From the press to `standing_at`.", "ms")
    ] = None
    tries: Annotated[
        int, Means("Number of times it was sent; all transports at once count once.")
    ] = 0
    reason: _Reason = None
    pressed_at: Annotated[
        float | None, _time("A finger pressed.", "browser, corrected to iVeg's")
    ] = None
    goal: Annotated[Json | None, Means("Place that a goal leads to.", "m", "map")] = (
        None
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandEventRecord:
    """One change of one command: a row of the audit, never altered."""

    command_id: Annotated[str, Means("The order.")]
    robot_id: _Robot
    at: Annotated[float, _time("When.")]
    state: Annotated[str, Means("State from then on.")]
    why: Annotated[str, Means("Its cause.")] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class AlertRecord:
    """One alert to people, in its present state (ISA-18.2)."""

    alert_id: Annotated[str, Means("The alert.")]
    priority: Annotated[
        Literal["P1", "P2", "P3"],
        Means("The gravest of what holds and of what nobody has acknowledged."),
    ]
    key: _Key
    raised_at: Annotated[float, _time("The first time.")]
    last_raised_at: Annotated[float, _time("The newest time.")]
    slots: _Slots = field(default_factory=dict)
    robot_id: _RobotIfAny = None
    cleared_at: Annotated[float | None, _time("It was over; none: it is not.")] = None
    acknowledged_at: Annotated[float | None, _time("A person took note.")] = None
    acknowledged_by: Annotated[str | None, Means("Person who took note.")] = None
    note: Annotated[str | None, Means("Note of that person.")] = None
    count: Annotated[int, Means("Number of its occurrences.")] = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class LogRecord:
    """One line of the action and inference log."""

    id: Annotated[int, Means("Number of the line in the live log; it rises.")]
    at: Annotated[float, _time("It happened.")]
    kind: Annotated[
        str, Means("`detection`, `speed`, `command`, `link`, `alert` or `system`.")
    ]
    key: _Key
    slots: _Slots = field(default_factory=dict)
    robot_id: _RobotIfAny = None
    class_: _Class = None
    decision_id: Annotated[
        str | None, Means("The decision behind it.", joins="decisions: `decision_id`")
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryRecord:
    """Pose and speed of a robot, with its speed limit and the applied factor."""

    at: Annotated[
        float, _time("The rule judged the pose, two ticks after its arrival at most.")
    ]
    robot_id: Annotated[
        str, Means("The robot.", joins="decisions, detections, readings: by time")
    ]
    x: Annotated[float, Means("Position of `base_link`.", "m", "map")]
    y: Annotated[float, Means("Position of `base_link`.", "m", "map")]
    yaw: Annotated[float, Means("Heading, counterclockwise from x.", "rad", "map")]
    linear: Annotated[float, Means("Speed forward.", "m/s", "base_link")]
    angular: Annotated[float, Means("Turning rate.", "rad/s", "base_link")]
    limit_factor: Annotated[float, Means("Speed limit of iVeg.", "0, 0.5 or 1")]
    applied_factor: Annotated[
        float | None, Means("Factor that the robot reports.", "0 to 1")
    ] = None
    link: Annotated[str | None, Means("Its link: `LIVE`, `LATE` or `LOST`.")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ClimateRecord:
    """One reading of the air in the greenhouse; None where a sensor was silent."""

    at: _Arrived
    temperature: Annotated[float | None, Means("Temperature of the air.", "°C")] = None
    relative_humidity: Annotated[
        float | None, Means("Relative humidity of the air.", "0 to 1")
    ] = None
    co2: Annotated[float | None, Means("Carbon dioxide.", "ppm")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingRecord:
    """One reading of a small sensor of one robot."""

    at: _Arrived
    robot_id: _Robot
    kind: Annotated[str, Means("The sensor, such as `battery`.")]
    value: Annotated[Json, Means("Its quantities by name (docs/interfaces/mqtt.md).")]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementRecord:
    """One number of other equipment, as its tile shows it."""

    at: _Arrived
    entity_id: Annotated[str, Means("Entity at Orion.")]
    attribute: Annotated[str, Means("Its attribute.")]
    value: Annotated[float, Means("The number.", "`unit`")]
    unit: Annotated[str, Means("Unit of `value`, as the tile had it then; `1`: none.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditRecord:
    """One act: a row of the audit, never altered (``domain.audit``)."""

    audit_id: Annotated[str, Means("The row; one offered twice is stored once.")]
    at: Annotated[float, _time("It happened.")]
    person: Annotated[str, Means("Id of the account.")]
    name: Annotated[str, Means("Name of the account, as it was then.")]
    role: Annotated[str, Means("Their role then.")]
    method: Annotated[str, Means("Way of signing in.")]
    action: Annotated[str, Means("The act, such as `stop` or `sign_in_refused`.")]
    subject: Annotated[
        str,
        Means("Its object, such as a robot's id; may be empty.", joins="`robot_id`"),
    ] = ""
    details: Annotated[
        str, Means("Status of the answer, and the request, as JSON.")
    ] = "{}"


_Telemetry = (
    OdometryRecord | DetectionRecord | ClimateRecord | ReadingRecord | MeasurementRecord
)
Order = CommandRecord | CommandEventRecord
Record = _Telemetry | Order | DecisionRecord | AlertRecord | LogRecord | AuditRecord
RECORD_TYPES: tuple[type[Record], ...] = get_args(Record)
LISTS: Final[Mapping[str, type[Record]]] = {
    "decisions": DecisionRecord,
    "commands": CommandRecord,
    "alerts": AlertRecord,
    "log": LogRecord,
    "detections": DetectionRecord,
    # Tracks are the detections with a person.
    "tracks": DetectionRecord,
    "odometry": OdometryRecord,
    "readings": ReadingRecord,
    "measurements": MeasurementRecord,
    "audit": AuditRecord,
}
"""Lists on pages and in exports, by name."""


def is_telemetry(record: Record) -> bool:
    """Whether a record is dropped first under pressure."""
    return isinstance(record, _Telemetry)


def is_order(record: Record) -> bool:
    """Whether a record is of an order, which is in the journal and never dropped."""
    return isinstance(record, Order)


# --- columns --------------------------------------------------------------------------

ColumnType = Literal["time", "number", "integer", "flag", "text", "json"]
_TYPES: Final[Mapping[object, ColumnType]] = {
    float: "number",
    bool: "flag",
    int: "integer",
    str: "text",
}


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a kind of row.

    Attributes:
        name: Its name in tables, files and JSON.
        key: Its attribute of the record, which is ``class_`` for ``class``.
        hint: Python type of a value.
        may_lack: Whether a row may be without it.
        transport: Its transport, for a column of times by transport.
    """

    name: str
    key: str
    hint: Any
    type: ColumnType
    may_lack: bool
    meaning: Means
    transport: TransportId | None = None

    def read(self, record: Record) -> Any:
        """Value of the column in a row."""
        if self.transport is None:
            return getattr(record, self.key)
        return getattr(record, self.key).get(self.transport)


def _column(key: str, hint: Any) -> Column:
    plain, meaning = get_args(hint)
    parts = [plain]
    # ``X | None`` has either origin, depending on what X is.
    if get_origin(plain) in (UnionType, Union):
        parts = list(get_args(plain))
    may_lack = type(None) in parts
    first = str if get_origin(parts[0]) is Literal else parts[0]
    type_ = _TYPES.get(first, "json")
    if first is float and meaning.clock:
        type_ = "time"
    return Column(key.rstrip("_"), key, plain, type_, may_lack, meaning)


def _shown(column: Column) -> Iterator[Column]:
    """The column, or a column for each transport for times by transport."""
    if column.hint != ByTransport:
        yield column
        return
    # Reversed, as programs that read by position rely on this order.
    for transport in reversed(TRANSPORTS):
        yield replace(
            column,
            name=column.name.replace("_at", f"_{transport.id}_at"),
            hint=float | None,
            type="time",
            may_lack=True,
            transport=transport.id,
        )


COLUMNS: Final[Mapping[type, tuple[Column, ...]]] = {
    kind: tuple(
        _column(key, hint)
        for key, hint in get_type_hints(kind, include_extras=True).items()
    )
    for kind in RECORD_TYPES
}
"""Columns of each kind of row in the database."""
SHOWN_COLUMNS: Final[Mapping[type, tuple[Column, ...]]] = {
    kind: tuple(shown for column in columns for shown in _shown(column))
    for kind, columns in COLUMNS.items()
}
"""Columns of each kind of row in files and JSON."""
