"""The data dictionary of exports: every column of every list, from the records.

    python -m iveg.models.dictionary

prints docs/interfaces/columns.md.

What each column of the exported lists means.
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


@dataclass(frozen=True, slots=True)
class Meaning:
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


def _time(means: str, clock: str = "iVeg") -> Meaning:
    return Meaning(means, clock=clock)


_ROBOT_JOIN = "odometry: the newest `at` not after it, of the same `robot_id`"


_PLACE = "Place of what was seen or judged; empty where places are no longer kept."


MEANINGS: Final[Mapping[str, Meaning]] = {
    "decision_id": Meaning("The decision.", joins="decisions, log: `decision_id`"),
    "command_id": Meaning("The order.", joins="GET /commands/{id} has its steps"),
    "alert_id": Meaning("The alert."),
    "id": Meaning("Number of the line in the live log."),
    "kind": Meaning("Which kind of row it is."),
    "robot_id": Meaning("The robot.", joins=_ROBOT_JOIN),
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
    "stamp": Meaning("Time of the picture as the robot sent it.", clock="robot"),
    "person_id": Meaning(
        "The person.", joins="decisions, detections, tracks: `person_id`"
    ),
    "observer": Meaning(
        "The robot that saw the person.", joins="`robot_id` of other lists"
    ),
    "class": Meaning("Canonical class; empty: unknown to the table of classes."),
    "class_id": Meaning("Class as the detector said."),
    "confidence": Meaning("Confidence of the detection.", "0 to 1"),
    "probability": Meaning("Confidence of the detection.", "0 to 1"),
    "confident": Meaning("Whether it reached the threshold of the rule in force."),
    "x": Meaning(_PLACE, "m", "map"),
    "y": Meaning(_PLACE, "m", "map"),
    "z": Meaning(_PLACE, "m", "map"),
    "yaw": Meaning("Heading, counterclockwise from x.", "rad", "map"),
    "linear": Meaning("Speed forward.", "m/s", "base_link"),
    "angular": Meaning("Turning rate.", "rad/s", "base_link"),
    "margin_m": Meaning(
        "Least margin to anybody seen, while it moves; empty: unknown or nobody.", "m"
    ),
    "distance_m": Meaning("From the robot to the centre of the ring.", "m"),
    "speed_factor": Meaning("What the robot was limited to.", "0, 0.5 or 1"),
    "limit_factor": Meaning("Speed limit of iVeg.", "0, 0.5 or 1"),
    "applied_factor": Meaning("Factor that the robot reports.", "0 to 1"),
    "link": Meaning("Its link: LIVE, LATE or LOST."),
    "reason": Meaning("Why, as a code (docs/interfaces)."),
    "rule_id": Meaning("The rule."),
    "rule_version": Meaning("Its version.", joins="GET /rule/versions: `version`"),
    "rule_parameters": Meaning("Its parameters at that moment."),
    "in_sight": Meaning("Whether the robot itself could see the cause."),
    "speed_before": Meaning("Speed measured at `started_at`.", "m/s"),
    "speed_after": Meaning("Speed at `observed_at`.", "m/s"),
    "links": Meaning("Links of the chain, each with time, value and verdict."),
    "transport": Meaning("Transport whose copy was first: `direct` or `fiware`."),
    "box": Meaning("The box as sent, with its `frame_id`.", "m", "its `frame_id`"),
    "state": Meaning("State of the order."),
    "requested_by": Meaning("Who asked."),
    "standstill_ms": Meaning("From the press to `standing_at`.", "ms"),
    "tries": Meaning("How often it was sent."),
    "goal": Meaning("Where a goal leads.", "m", "map"),
    "priority": Meaning("P1, P2 or P3."),
    "key": Meaning("Template of its sentence; `slots` fill it."),
    "slots": Meaning("What fills the sentence."),
    "acknowledged_by": Meaning("Who took note."),
    "note": Meaning("What they wrote."),
    "count": Meaning("How often it was raised while it lived."),
    "value": Meaning("The reading."),
    "entity_id": Meaning("Entity at Orion."),
    "attribute": Meaning("Its attribute."),
    "unit": Meaning("Unit of `value`."),
    "audit_id": Meaning("The row."),
    "person": Meaning("Id of the account."),
    "name": Meaning("How they were called then."),
    "role": Meaning("Their role then."),
    "method": Meaning("How they had signed in."),
    "action": Meaning("What they did."),
    "subject": Meaning("To what, such as a robot's id.", joins="`robot_id`, …"),
    "details": Meaning("What belongs to it, as JSON."),
}
"""By column; the same name means the same in every list, but for the next table."""


MEANINGS_APART: Final[Mapping[tuple[str, str], Meaning]] = {
    ("alerts", "robot_id"): Meaning("The robot; empty: none."),
    ("log", "robot_id"): Meaning("The robot; empty: none."),
    ("odometry", "robot_id"): Meaning(
        "The robot.", joins="decisions, detections, readings: `robot_id`, by time"
    ),
    ("odometry", "x"): Meaning("Position of the robot.", "m", "map"),
    ("odometry", "y"): Meaning("Position of the robot.", "m", "map"),
    ("log", "at"): _time("It happened."),
    ("decisions", "kind"): Meaning("`alert` or `mandate` (a speed limit)."),
    ("commands", "kind"): Meaning("`stop`, `release`, `resume` or `goal`."),
    ("readings", "kind"): Meaning("The sensor, such as `battery`."),
    ("readings", "value"): Meaning("By name of its fields (docs/interfaces/mqtt.md)."),
    ("measurements", "value"): Meaning("The number.", "`unit`"),
}


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

_HEAD: Final = """\
# Columns of exports

This page is generated: `python -m iveg.models.dictionary > docs/interfaces/columns.md`.
"""
ColumnType = Literal["time", "number", "integer", "flag", "text", "json"]
_PLAIN_TYPES: Final[Mapping[object, ColumnType]] = MappingProxyType(
    {bool: "flag", int: "integer", str: "text"}
)


@dataclass(frozen=True, slots=True)
class Column:
    """One column of one list: its name, type and meaning, and how a record has it."""

    name: str
    type: ColumnType
    meaning: Meaning
    read: Callable[[Record], object]


def columns_of(name: str) -> Sequence[Column]:
    """The columns of a list, in the order in which files have them."""
    return tuple(_columns(name, LISTS[name]))


def _columns(name: str, kind: type[Record]) -> Iterator[Column]:
    hints = typing.get_type_hints(kind)
    for column, read in readers_of(kind):
        hint = hints.get(column, float | None)
        shown = column.rstrip("_")
        meaning = MEANINGS_APART.get((name, shown)) or MEANINGS[shown]
        yield Column(shown, _type_of(shown, hint), meaning, read)


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
    """One column of an exported list; empty where nothing is to be said.

    Attributes:
        list: List, as in its address.
        column: Name.
        type: Of its values.
        unit: Unit or range.
        frame: Frame of coordinates.
        clock: Whose clock a time is by.
        means: Meaning.
        joins: How its rows find those of other lists.
    """

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
        DictionaryColumn(
            list=name, column=one.name, type=one.type, **asdict(one.meaning)
        )
        for name in LISTS
        for one in columns_of(name)
    ]


def describe() -> str:
    """The whole of docs/interfaces/columns.md."""
    lines = [_HEAD]
    for name in LISTS:
        lines += [
            f"## {name}",
            "",
            "| column | type | unit | frame | clock | meaning | joins |",
            "|---|---|---|---|---|---|---|",
        ]
        for one in columns_of(name):
            meant = one.meaning
            cells = (f"`{one.name}`", one.type, meant.unit, meant.frame, meant.clock)
            lines.append(f"| {' | '.join((*cells, meant.means, meant.joins))} |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.stdout.write(describe())
