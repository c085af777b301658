"""Remembered records as integrators read them: the names of the live topics."""

from collections.abc import Sequence
from typing import Generic, TypeVar

import orjson
from pydantic import BaseModel, ConfigDict, Field, JsonValue

from iveg.adapters.history.series import ClimateSeries
from iveg.domain.records import (
    AlertRecord,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
)
from iveg.domain.stop.outcome import outcome_of, was_loud
from iveg.ngsi.codec import format_stamp
from iveg.web import schemas


class View(BaseModel):
    """Base of what history answers."""

    model_config = ConfigDict(frozen=True)


V = TypeVar("V", bound=View)


class Listing(View, Generic[V]):
    """One page, newest first; ``next`` is the cursor of the page after it."""

    items: list[V]
    next: str | None


class PointView(View):
    """A place in ``map`` (m)."""

    x: float
    y: float
    z: float


class DetectionView(View):
    """One detection; ``received_at`` is when it reached iVeg."""

    robot_id: str
    stamp: str | None
    received_at: str
    class_: str | None = Field(serialization_alias="class")
    class_id: str
    probability: float
    position: PointView
    box: JsonValue
    confident: bool
    person_id: str | None
    road: str


class CommandTimes(View):
    """When each step of a command came to be known; null where it has not yet."""

    pressed: str | None
    requested: str
    sent_fiware: str | None
    sent_direct: str | None
    answer_fiware: str | None
    answer_direct: str | None
    standing: str | None


class StepView(View):
    """One line of the audit trail of a command."""

    at: str
    state: str
    why: str


class CommandView(View):
    """One STOP, release or resume, how it ended, and each of its steps."""

    command_id: str
    robot_id: str
    kind: str
    drill: bool
    state: str
    requested_by: str
    times: CommandTimes
    standstill_ms: float | None
    tries: int
    reason: str | None
    outcome: str
    was_loud: bool
    steps: list[StepView]


class AlertView(View):
    """One notice, through its life; ``members`` are its newest occurrences."""

    alert_id: str
    priority: str
    key: str
    slots: JsonValue
    robot_id: str | None
    raised_at: str
    last_raised_at: str
    cleared_at: str | None
    acknowledged_at: str | None
    acknowledged_by: str | None
    note: str | None
    count: int
    members: list[schemas.OccurrenceJson]


class AlertListing(Listing[AlertView]):
    """One page of alerts, and how fast they come now."""

    flood: schemas.FloodJson


class EntryView(View):
    """One line of the log."""

    id: int
    at: str
    kind: str
    robot_id: str | None
    key: str
    slots: JsonValue
    class_: str | None = Field(serialization_alias="class")
    decision_id: str | None


class RuleView(View):
    """The rule that fired, as it was at that moment."""

    id: str | None
    version: str | None
    parameters: JsonValue


class LinkView(View):
    """One link of the chain of evidence."""

    link: str
    at: str | None
    value: JsonValue
    verdict: str


class SentenceView(View):
    """A template's name and what fills its holes."""

    key: str
    slots: dict[str, str | float | bool | None]


class DecisionView(View):
    """Who was seen by whom, which rule fired, and when the robot obeyed."""

    decision_id: str
    kind: str
    robot_id: str
    person_id: str | None
    observer: str | None
    class_: str | None = Field(serialization_alias="class")
    class_id: str | None
    confidence: float | None
    position: PointView | None
    distance_m: float | None
    speed_factor: float | None
    reason: str | None
    rule: RuleView
    in_sight: bool | None
    started_at: str
    feedback_at: str | None
    applied_at: str | None
    observed_at: str | None
    ended_at: str | None
    speed_before: float | None
    speed_after: float | None
    links: list[LinkView]
    sentence: SentenceView


def view_detection(record: DetectionRecord) -> DetectionView:
    """As ``GET /detections`` lists it."""
    return DetectionView(
        robot_id=record.robot_id,
        stamp=record.stamp,
        received_at=format_stamp(record.at),
        class_=record.class_,
        class_id=record.class_id,
        probability=record.probability,
        position=PointView(x=record.x, y=record.y, z=record.z),
        box=_json(record.box),
        confident=record.confident,
        person_id=record.person_id,
        road=record.road,
    )


def view_command(
    record: CommandRecord, steps: Sequence[CommandEventRecord] = ()
) -> CommandView:
    """As ``GET /commands`` lists it."""
    return CommandView(
        command_id=record.command_id,
        robot_id=record.robot_id,
        kind=record.kind,
        drill=record.drill,
        state=record.state,
        requested_by=record.requested_by,
        times=CommandTimes(
            pressed=_time(record.pressed_at),
            requested=format_stamp(record.requested_at),
            sent_fiware=_time(record.sent_fiware_at),
            sent_direct=_time(record.sent_direct_at),
            answer_fiware=_time(record.answer_fiware_at),
            answer_direct=_time(record.answer_direct_at),
            standing=_time(record.standing_at),
        ),
        standstill_ms=record.standstill_ms,
        tries=record.tries,
        reason=record.reason,
        outcome=outcome_of(record),
        was_loud=was_loud((record.state, *(step.state for step in steps))),
        steps=[
            StepView(at=format_stamp(step.at), state=step.state, why=step.why)
            for step in steps
        ],
    )


def view_alert(record: AlertRecord) -> AlertView:
    """As ``GET /alerts`` lists it."""
    return AlertView(
        alert_id=record.alert_id,
        priority=record.priority,
        key=record.key,
        slots=_json(record.slots),
        robot_id=record.robot_id,
        raised_at=format_stamp(record.raised_at),
        last_raised_at=format_stamp(record.last_raised_at),
        cleared_at=_time(record.cleared_at),
        acknowledged_at=_time(record.acknowledged_at),
        acknowledged_by=record.acknowledged_by,
        note=record.note,
        count=record.count,
        members=[_member(one) for one in _objects(record.members)],
    )


def view_entry(record: LogRecord) -> EntryView:
    """As ``GET /log`` lists it."""
    return EntryView(
        id=record.id,
        at=format_stamp(record.at),
        kind=record.kind,
        robot_id=record.robot_id,
        key=record.key,
        slots=_json(record.slots),
        class_=record.class_,
        decision_id=record.decision_id,
    )


def view_decision(record: DecisionRecord) -> DecisionView:
    """As ``GET /decisions`` lists it."""
    return DecisionView(
        decision_id=record.decision_id,
        kind=record.kind,
        robot_id=record.robot_id,
        person_id=record.person_id,
        observer=record.observer,
        class_=record.class_,
        class_id=record.class_id,
        confidence=record.confidence,
        position=_position(record),
        distance_m=record.distance_m,
        speed_factor=record.speed_factor,
        reason=record.reason,
        rule=RuleView(
            id=record.rule_id,
            version=record.rule_version,
            parameters=_json(record.rule_parameters),
        ),
        in_sight=record.in_sight,
        started_at=format_stamp(record.started_at),
        feedback_at=_time(record.feedback_at),
        applied_at=_time(record.applied_at),
        observed_at=_time(record.observed_at),
        ended_at=_time(record.ended_at),
        speed_before=record.speed_before,
        speed_after=record.speed_after,
        links=[_link(link) for link in _objects(record.links)],
        sentence=_sentence(record),
    )


def view_climate(series: ClimateSeries) -> list[dict[str, str | float | None]]:
    """Readings as the live topic names them, oldest first."""
    columns = (series.at, series.temperature, series.relative_humidity, series.co2)
    return [
        {
            "at": format_stamp(at),
            "temperature": _rounded(temperature, 2),
            "relative_humidity": _rounded(humidity, 4),
            "co2": _rounded(co2, 1),
        }
        for at, temperature, humidity, co2 in zip(*columns, strict=True)
    ]


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)


def _position(record: DecisionRecord) -> PointView | None:
    if record.x is None or record.y is None:
        return None
    return PointView(x=record.x, y=record.y, z=record.z or 0.0)


def _sentence(record: DecisionRecord) -> SentenceView:
    """The same words that the log used when it happened."""
    if record.kind == "alert":
        key = "log.person_seen"
    elif record.in_sight is False:
        key = f"log.speed_down.{record.reason}_nlos"
    else:
        key = f"log.speed_down.{record.reason or 'default'}"
    slots: dict[str, str | float | bool | None] = {
        "robot": record.robot_id,
        "person": record.person_id,
        "observer": record.observer,
        "class": record.class_,
        "class_id": record.class_id,
        "confidence": record.confidence,
        "factor": record.speed_factor,
        "reason": record.reason,
        "distance": record.distance_m,
        "in_sight": record.in_sight,
    }
    return SentenceView(key=key, slots=slots)


def _objects(text: str) -> list[dict[str, JsonValue]]:
    found = _json(text)
    items = found if isinstance(found, list) else []
    return [one for one in items if isinstance(one, dict)]


def _member(one: dict[str, JsonValue]) -> schemas.OccurrenceJson:
    by, note = one.get("acknowledged_by"), one.get("note")
    return {
        "priority": str(one.get("priority")),
        "raised_at": _moment(one.get("raised_at")) or "",
        "cleared_at": _moment(one.get("cleared_at")),
        "acknowledged_at": _moment(one.get("acknowledged_at")),
        "acknowledged_by": None if by is None else str(by),
        "note": None if note is None else str(note),
    }


def _moment(at: JsonValue) -> str | None:
    return format_stamp(at) if isinstance(at, int | float) else None


def _link(link: dict[str, JsonValue]) -> LinkView:
    return LinkView(
        link=str(link.get("link")),
        at=_moment(link.get("at")),
        value=link.get("value"),
        verdict=str(link.get("verdict")),
    )


def _json(text: str | None) -> JsonValue:
    """Our own JSON text back as a value; null where a row holds none that is whole."""
    try:
        value: JsonValue = orjson.loads(text or "null")
    except orjson.JSONDecodeError:
        return None
    return value


def _time(at: float | None) -> str | None:
    return None if at is None else format_stamp(at)
