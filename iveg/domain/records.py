"""Rows of the history, each declared once: one frozen value each.

A column's meaning stands beside it.  From these declarations follow the tables
(``adapters.history.tables``), the keys of REST and NDJSON (``models``), the columns of
CSV and their page (``models.dictionary``).

All times are Unix seconds UTC, positions are in ``map`` (m), speeds in m/s and rad/s.
A decision, a command and an alert change state: a later record with the same id takes
the place of the earlier one.  The other records are facts that are only ever added.
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
"""An object: what JSON can hold, which the history keeps as such, not as text."""
ByTransport = Mapping[TransportId, float]
"""A time for each transport that has one (Unix s)."""


@dataclass(frozen=True, slots=True)
class Means:
    """Meaning of a column.

    Attributes:
        means: In one sentence.
        unit: Empty where it has none.
        frame: Frame of coordinates; empty where it is no place.
        clock: Whose clock it is by; empty where it is no time.
        joins: How its rows find those of other lists.
    """

    means: str
    unit: str = ""
    frame: str = ""
    clock: str = ""
    joins: str = ""


def _time(means: str, clock: str = "iVeg") -> Means:
    return Means(means, clock=clock)


_ROBOT = Means(
    "The robot.", joins="odometry: the newest `at` not after it, of the same `robot_id`"
)
_PERSON = Means("The track.", joins="decisions, detections, tracks: `person_id`")
_CLASS = Means("Canonical class; none: unknown to the table of classes.")
_CLASS_ID = Means("Class as the detector said.")
_CONFIDENCE = Means("Confidence of the detection.", "0 to 1")
_PLACE = Means(
    "Place of what was seen or judged; none where it is no longer kept.", "m", "map"
)
_REASON = Means("Why, as a code (docs/interfaces).")
_KEY = Means("Template of its sentence; `slots` fill it.")
_SLOTS = Means("Values of its sentence.")
_ARRIVED = _time("It reached iVeg.")


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
    robot_id: Annotated[str, replace(_ROBOT, means="Robot that was limited, or saw.")]
    started_at: Annotated[float, _time("The rule fired.")]
    person_id: Annotated[str | None, _PERSON] = None
    observer: Annotated[
        str | None, Means("Robot that saw it.", joins="`robot_id` of other lists")
    ] = None
    class_: Annotated[str | None, _CLASS] = None
    class_id: Annotated[str | None, _CLASS_ID] = None
    confidence: Annotated[float | None, _CONFIDENCE] = None
    x: Annotated[float | None, _PLACE] = None
    y: Annotated[float | None, _PLACE] = None
    z: Annotated[float | None, _PLACE] = None
    distance_m: Annotated[
        float | None, Means("From the robot to the centre of the zone.", "m")
    ] = None
    speed_factor: Annotated[float | None, Means("The limit.", "0, 0.5 or 1")] = None
    reason: Annotated[str | None, _REASON] = None
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

    at: Annotated[float, _ARRIVED]
    robot_id: Annotated[str, _ROBOT]
    class_id: Annotated[str, _CLASS_ID]
    probability: Annotated[float, _CONFIDENCE]
    x: Annotated[float | None, _PLACE] = None
    y: Annotated[float | None, _PLACE] = None
    z: Annotated[float | None, _PLACE] = None
    confident: Annotated[
        bool, Means("Whether it reached the threshold of the rule in force.")
    ]
    transport: Annotated[
        str, Means("Transport whose copy was first: `direct` or `fiware`.")
    ]
    stamp: Annotated[
        str | None, _time("Time of the picture as the robot sent it.", "robot")
    ] = None
    class_: Annotated[str | None, _CLASS] = None
    person_id: Annotated[str | None, _PERSON] = None
    box: Annotated[
        Json | None, Means("The box as sent, with its `frame_id`.", "m", "its own")
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandRecord:
    """One STOP, release, resume or goal as it stands now.

    The state is one of the nine of the STOP machine, RUNNING at the end of a STOP,
    REPLACED or EXPIRED where another command took over; of a goal one of
    ``domain.goals``.
    """

    command_id: Annotated[
        str, Means("The order (ULID).", joins="GET /commands/{id} has its steps")
    ]
    robot_id: Annotated[str, _ROBOT]
    kind: Annotated[
        Literal["stop", "release", "resume", "goal"], Means("What was asked.")
    ]
    state: Annotated[
        str,
        Means("One of the nine states of STOP, `RUNNING`, `REPLACED` or `EXPIRED`."),
    ]
    requested_by: Annotated[str, Means("Who asked first.")]
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
        int, Means("How often it was sent; all transports at once count once.")
    ] = 0
    reason: Annotated[str | None, _REASON] = None
    pressed_at: Annotated[
        float | None, _time("A finger pressed.", "browser, corrected to iVeg's")
    ] = None
    goal: Annotated[Json | None, Means("Place that a goal leads to.", "m", "map")] = (
        None
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandEventRecord:
    """One change of one command: a line of the audit trail, never altered."""

    command_id: Annotated[str, Means("The order.")]
    robot_id: Annotated[str, _ROBOT]
    at: Annotated[float, _time("When.")]
    state: Annotated[str, Means("State from then on.")]
    why: Annotated[str, Means("What led to it.")] = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class AlertRecord:
    """One alert to people, through its life (ISA-18.2)."""

    alert_id: Annotated[str, Means("The alert.")]
    priority: Annotated[
        Literal["P1", "P2", "P3"],
        Means("The gravest of what holds and of what nobody has acknowledged."),
    ]
    key: Annotated[str, _KEY]
    raised_at: Annotated[float, _time("The first time.")]
    last_raised_at: Annotated[float, _time("The newest time.")]
    slots: Annotated[Json, _SLOTS] = field(default_factory=dict)
    robot_id: Annotated[
        str | None, replace(_ROBOT, means="The robot, if it is about one.")
    ] = None
    cleared_at: Annotated[float | None, _time("It was over; none: it is not.")] = None
    acknowledged_at: Annotated[float | None, _time("A person took note.")] = None
    acknowledged_by: Annotated[str | None, Means("Who took note.")] = None
    note: Annotated[str | None, Means("What they wrote.")] = None
    count: Annotated[int, Means("How often it was raised while it lived.")] = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class LogRecord:
    """One line of the action and inference log."""

    id: Annotated[int, Means("Number of the line in the live log; it rises.")]
    at: Annotated[float, _time("It happened.")]
    kind: Annotated[
        str, Means("`detection`, `speed`, `command`, `link`, `alert` or `system`.")
    ]
    key: Annotated[str, _KEY]
    slots: Annotated[Json, _SLOTS] = field(default_factory=dict)
    robot_id: Annotated[
        str | None, replace(_ROBOT, means="The robot, if it is about one.")
    ] = None
    class_: Annotated[str | None, _CLASS] = None
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

    at: Annotated[float, _ARRIVED]
    temperature: Annotated[float | None, Means("Of the air.", "°C")] = None
    relative_humidity: Annotated[float | None, Means("Of the air.", "0 to 1")] = None
    co2: Annotated[float | None, Means("Carbon dioxide.", "ppm")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingRecord:
    """One reading of a small sensor of one robot."""

    at: Annotated[float, _ARRIVED]
    robot_id: Annotated[str, _ROBOT]
    kind: Annotated[str, Means("The sensor, such as `battery`.")]
    value: Annotated[Json, Means("Its quantities by name (docs/interfaces/mqtt.md).")]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementRecord:
    """One number of other equipment, as its tile shows it."""

    at: Annotated[float, _ARRIVED]
    entity_id: Annotated[str, Means("Entity at Orion.")]
    attribute: Annotated[str, Means("Its attribute.")]
    value: Annotated[float, Means("The number.", "`unit`")]
    unit: Annotated[str, Means("Unit of `value`, as the tile had it then; `1`: none.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditRecord:
    """An act of somebody: a row of the audit, never changed (``domain.audit``)."""

    audit_id: Annotated[str, Means("The row; one offered twice is stored once.")]
    at: Annotated[float, _time("It happened.")]
    person: Annotated[str, Means("Id of the account.")]
    name: Annotated[str, Means("Name of the account, as it was then.")]
    role: Annotated[str, Means("Their role then.")]
    method: Annotated[str, Means("Way of signing in.")]
    action: Annotated[str, Means("What they did, such as `stop` or `sign_in_refused`.")]
    subject: Annotated[
        str, Means("To what, such as a robot's id; may be empty.", joins="`robot_id`")
    ] = ""
    details: Annotated[
        str, Means("Status of the answer and what was asked, as JSON.")
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
    "tracks": DetectionRecord,
    "odometry": OdometryRecord,
    "readings": ReadingRecord,
    "measurements": MeasurementRecord,
    "audit": AuditRecord,
}
"""Lists that are shown and exported, by name."""


def is_telemetry(record: Record) -> bool:
    """Whether a record is dropped first under pressure."""
    return isinstance(record, _Telemetry)


def is_order(record: Record) -> bool:
    """Whether a record is of an order: in the journal, and never dropped."""
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
        name: In tables, files and JSON; ``key`` of the record, which is ``class_`` for
            ``class``.
        hint: Python's type of a value.
        may_lack: Whether a row may be without it.
        transport: The one whose time it is, of a time for each.
    """

    name: str
    key: str
    hint: Any
    type: ColumnType
    may_lack: bool
    meaning: Means
    transport: TransportId | None = None

    def read(self, record: Record) -> Any:
        """Its value of a row."""
        if self.transport is None:
            return getattr(record, self.key)
        return getattr(record, self.key).get(self.transport)


def _column(key: str, hint: Any) -> Column:
    plain, meaning = get_args(hint)
    parts = [plain]
    if get_origin(plain) in (UnionType, Union):
        parts = list(get_args(plain))
    may_lack = type(None) in parts
    first = str if get_origin(parts[0]) is Literal else parts[0]
    type_ = _TYPES.get(first, "json")
    if first is float and meaning.clock:
        type_ = "time"
    return Column(key.rstrip("_"), key, plain, type_, may_lack, meaning)


def _shown(column: Column) -> Iterator[Column]:
    """The column; of times by transport one for each."""
    if column.hint != ByTransport:
        yield column
        return
    # Programs that read by position know this order.
    for one in reversed(TRANSPORTS):
        name = column.name.replace("_at", f"_{one.id}_at")
        yield replace(
            column,
            name=name,
            hint=float | None,
            type="time",
            may_lack=True,
            transport=one.id,
        )


COLUMNS: Final[Mapping[type, tuple[Column, ...]]] = {
    kind: tuple(
        _column(key, hint)
        for key, hint in get_type_hints(kind, include_extras=True).items()
    )
    for kind in RECORD_TYPES
}
"""The columns of each kind of row, as the database has them."""
SHOWN_COLUMNS: Final[Mapping[type, tuple[Column, ...]]] = {
    kind: tuple(each for one in columns for each in _shown(one))
    for kind, columns in COLUMNS.items()
}
"""The same as files and JSON have them."""
