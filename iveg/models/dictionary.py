"""The data dictionary of exports: every column of every list, from the records.

    python -m iveg.models.dictionary

writes the tables of docs/interfaces/exports.md.
"""

import sys
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from operator import attrgetter
from types import MappingProxyType, UnionType
from typing import Any, Final, Literal

from iveg.domain.records import (
    AlertRecord,
    AuditRecord,
    ByTransport,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
    Record,
)
from iveg.domain.transports import TRANSPORTS, TransportId
from iveg.models.base import Model

LISTS: Final[Mapping[str, type[Record]]] = MappingProxyType(
    {
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
)
"""Lists that are exported, by name."""

ColumnType = Literal["time", "number", "integer", "flag", "text", "json"]
_PLAIN_TYPES: Final[Mapping[object, ColumnType]] = MappingProxyType(
    {bool: "flag", int: "integer", str: "text"}
)


@dataclass(frozen=True, slots=True)
class Told:
    """What a column means.

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


@dataclass(frozen=True, slots=True)
class Column:
    """One column of one list: its name, type and meaning, and how a record has it."""

    name: str
    type: ColumnType
    told: Told
    read: Callable[[Record], object]


def _time(means: str, clock: str = "iVeg") -> Told:
    return Told(means, clock=clock)


_ROBOT_JOIN = "odometry: the newest `at` not after it, of the same `robot_id`"
_PLACE = "Place of what was seen or judged; empty where places are no longer kept."
MEANINGS: Final[Mapping[str, Told]] = {
    "decision_id": Told("The decision.", joins="decisions, log: `decision_id`"),
    "command_id": Told("The order.", joins="GET /commands/{id} has its steps"),
    "alert_id": Told("The alert."),
    "id": Told("Number of the line in the live log."),
    "kind": Told("Which kind of row it is."),
    "robot_id": Told("The robot.", joins=_ROBOT_JOIN),
    "started_at": _time("The rule fired."),
    "ended_at": _time("The rule let go; empty: it has not yet."),
    "feedback_at": _time("The feedback left."),
    "applied_at": _time("The robot reported the factor."),
    "observed_at": _time("The speed had come down."),
    "at": _time("It reached iVeg."),
    "requested_at": _time("iVeg took the order."),
    "pressed_at": _time("A finger pressed.", "browser, corrected to iVeg's"),
    "sent_fiware_at": _time("FIWARE first took it."),
    "sent_direct_at": _time("The broker first took it."),
    "answer_fiware_at": _time("The robot first answered, by FIWARE."),
    "answer_direct_at": _time("The robot first answered, by MQTT."),
    "standing_at": _time("First sample at rest."),
    "raised_at": _time("The first time."),
    "last_raised_at": _time("The newest time."),
    "cleared_at": _time("It was over; empty: it is not."),
    "acknowledged_at": _time("A person took note."),
    "stamp": Told("Time of the picture as the robot sent it.", clock="robot"),
    "person_id": Told(
        "The person.", joins="decisions, detections, tracks: `person_id`"
    ),
    "observer": Told(
        "The robot that saw the person.", joins="`robot_id` of other lists"
    ),
    "class": Told("Canonical class; empty: unknown to the table of classes."),
    "class_id": Told("Class as the detector said."),
    "confidence": Told("Confidence of the detection.", "0 to 1"),
    "probability": Told("Confidence of the detection.", "0 to 1"),
    "confident": Told("Whether it reached the threshold of the rule in force."),
    "x": Told(_PLACE, "m", "map"),
    "y": Told(_PLACE, "m", "map"),
    "z": Told(_PLACE, "m", "map"),
    "yaw": Told("Heading, counterclockwise from x.", "rad", "map"),
    "linear": Told("Speed forward.", "m/s", "base_link"),
    "angular": Told("Turning rate.", "rad/s", "base_link"),
    "margin_m": Told(
        "Least margin to anybody seen, while it moves; empty: unknown or nobody.", "m"
    ),
    "distance_m": Told("From the robot to the centre of the ring.", "m"),
    "speed_factor": Told("What the robot was limited to.", "0, 0.5 or 1"),
    "limit_factor": Told("Speed limit of iVeg.", "0, 0.5 or 1"),
    "applied_factor": Told("Factor that the robot reports.", "0 to 1"),
    "link": Told("Its link: LIVE, LATE or LOST."),
    "reason": Told("Why, as a code (docs/interfaces)."),
    "rule_id": Told("The rule."),
    "rule_version": Told("Its version.", joins="GET /rule/versions: `version`"),
    "rule_parameters": Told("Its parameters at that moment."),
    "in_sight": Told("Whether the robot itself could see the cause."),
    "speed_before": Told("Greatest speed of the second before.", "m/s"),
    "speed_after": Told("Speed at `observed_at`.", "m/s"),
    "links": Told("Links of the chain, each with time, value and verdict."),
    "transport": Told("Transport whose copy was first: `direct` or `fiware`."),
    "box": Told("The box as sent, with its `frame_id`.", "m", "its `frame_id`"),
    "state": Told("State of the order."),
    "requested_by": Told("Who asked."),
    "standstill_ms": Told("From the press to `standing_at`.", "ms"),
    "tries": Told("How often it was sent."),
    "drill": Told("Whether it was pressed to prove that STOP works."),
    "goal": Told("Where a goal leads.", "m", "map"),
    "priority": Told("P1, P2 or P3."),
    "key": Told("Template of its sentence; `slots` fill it."),
    "slots": Told("What fills the sentence."),
    "acknowledged_by": Told("Who took note."),
    "note": Told("What they wrote."),
    "count": Told("How often it was raised while it lived."),
    "members": Told("Its newest times, each with priority and life."),
    "value": Told("The reading."),
    "entity_id": Told("Entity at Orion."),
    "late": Told("The robot kept it during a gap and sent it afterwards."),
    "attribute": Told("Its attribute."),
    "unit": Told("Unit of `value`."),
    "audit_id": Told("The row."),
    "person": Told("Id of the account."),
    "name": Told("How they were called then."),
    "role": Told("Their role then."),
    "method": Told("How they had signed in."),
    "action": Told("What they did."),
    "subject": Told("To what, such as a robot's id.", joins="`robot_id`, …"),
    "details": Told("What belongs to it, as JSON."),
    "seq": Told("Place in the chain, without a gap."),
    "stored_at": _time("It got its place in the chain."),
    "previous_hash": Told("Of the row before (SHA-256, hex)."),
    "hash": Told("Its own (SHA-256, hex)."),
}
"""By column; the same name means the same in every list, but for the next table."""
MEANINGS_APART: Final[Mapping[tuple[str, str], Told]] = {
    ("alerts", "robot_id"): Told("The robot; empty: none."),
    ("log", "robot_id"): Told("The robot; empty: none."),
    ("odometry", "robot_id"): Told(
        "The robot.", joins="decisions, detections, readings: `robot_id`, by time"
    ),
    ("odometry", "x"): Told("Position of the robot.", "m", "map"),
    ("odometry", "y"): Told("Position of the robot.", "m", "map"),
    ("log", "at"): _time("It happened."),
    ("decisions", "kind"): Told("`alert` or `mandate` (a speed limit)."),
    ("commands", "kind"): Told("`stop`, `release`, `resume` or `goal`."),
    ("readings", "kind"): Told("The sensor, such as `battery`."),
    ("readings", "value"): Told("By name of its fields (docs/interfaces/mqtt.md)."),
    ("measurements", "value"): Told("The number.", "`unit`"),
}


def columns_of(name: str) -> Sequence[Column]:
    """The columns of a list, in the order in which files have them."""
    return tuple(_columns(name, LISTS[name]))


def _columns(name: str, kind: type[Record]) -> Iterator[Column]:
    hints = typing.get_type_hints(kind)
    for column, read in readers_of(kind):
        hint = hints.get(column, float | None)
        shown = column.rstrip("_")
        told = MEANINGS_APART.get((name, shown)) or MEANINGS[shown]
        yield Column(shown, _type_of(shown, hint), told, read)


def readers_of(kind: type[Any]) -> Iterator[tuple[str, Callable[[Any], object]]]:
    """A column a field; of what is kept by transport one for each of the table."""
    for one in fields(kind):
        if one.type != ByTransport:
            yield one.name, attrgetter(one.name)
            continue
        # Programs that read by position know this order.
        for transport in reversed(TRANSPORTS):
            name = one.name.replace("_at", f"_{transport.id}_at")
            yield name, partial(_of_transport, one.name, transport.id)


def _of_transport(name: str, transport: TransportId, record: Record) -> object:
    return getattr(record, name).get(transport)


def _type_of(name: str, hint: object) -> ColumnType:
    is_union = typing.get_origin(hint) in (UnionType, typing.Union)
    parts = set(typing.get_args(hint)) if is_union else {hint}
    if float in parts:
        return "time" if name == "at" or name.endswith("_at") else "number"
    for type_, called in _PLAIN_TYPES.items():
        if type_ in parts:
            return called
    return "text" if typing.get_origin(hint) is Literal else "json"


class DictionaryColumn(Model):
    """One column of an exported list; empty where nothing is to be said."""

    list: str
    column: str
    type: ColumnType
    unit: str
    frame: str
    clock: str
    means: str
    joins: str


def dictionary_columns() -> list[DictionaryColumn]:
    """All columns of all lists."""
    return [
        DictionaryColumn(list=name, column=one.name, type=one.type, **asdict(one.told))
        for name in LISTS
        for one in columns_of(name)
    ]


def describe() -> str:
    """The tables of docs/interfaces/exports.md."""
    lines = []
    for name in LISTS:
        lines += [
            f"### {name}",
            "",
            "| column | type | unit | frame | clock | meaning | joins |",
            "|---|---|---|---|---|---|---|",
        ]
        for one in columns_of(name):
            told = one.told
            cells = (f"`{one.name}`", one.type, told.unit, told.frame, told.clock)
            lines.append(f"| {' | '.join((*cells, told.means, told.joins))} |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.stdout.write(describe())
