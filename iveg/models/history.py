"""The past: rows of the history as REST, NDJSON and pages have them, and one day."""

import json
from typing import Literal, Self

from pydantic import Field, JsonValue

from iveg.domain.alerts import BookedAlert, write_alert
from iveg.domain.records import (
    AlertRecord,
    AuditRecord,
    DecisionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
)
from iveg.models.base import (
    GreenhouseMap,
    Hundredth,
    Model,
    Row,
    Slots,
    Stamp,
    Tenth,
    row_of,
)
from iveg.models.command import Command, Sentence


@row_of(AlertRecord)
class Alert(Row):
    """An alert to people: all occurrences of one kind and subject as one.

    A notice to people (ISA-18.2). One condition (kind and subject) that is back within
    10 minutes is the same alert, once more; each time it sounds and asks to be
    acknowledged anew. A condition that gets graver is raised anew at once. When it was
    over, and what somebody did about it, is of the newest time.
    """

    slots: Slots = Field(description="Values of its sentence.")

    @classmethod
    def of(cls, alert: BookedAlert) -> Self:
        """One alert as it is now."""
        return cls.from_value(write_alert(alert))


class AcknowledgedAlerts(Model):
    """Outcome of alerts that somebody acknowledged together.

    Attributes:
        items: Those that this acknowledged.
    """

    items: list[Alert]
    left: list[str] = Field(
        description="Ids that were left: P1s, seen ones, and what is no longer there."
    )


@row_of(LogRecord)
class LogEntry(Row):
    """One line of the action and inference log."""

    slots: Slots = Field(description="Values of its sentence.")


class Note(Model):
    """Somebody's words about a moment; nobody can change them.

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
    at: Stamp
    written_at: Stamp
    by: str
    text: str
    x: float | None
    y: float | None
    robot_id: str | None
    decision_id: str | None

    @classmethod
    def from_record(cls, line: LogRecord) -> Self:
        """Read its line in the log."""
        slots = line.slots
        return cls.from_value(
            line,
            note_id=line.id,
            at=slots.get("pinned_at", line.at),
            written_at=line.at,
            by=slots.get("by", ""),
            text=slots.get("text", ""),
            x=slots.get("x"),
            y=slots.get("y"),
        )


@row_of(AuditRecord)
class AuditEntry(Row):
    """One row of the audit."""

    details: dict[str, JsonValue] = Field(
        description=(
            "``status`` of the answer, and what was asked; of a rule the new "
            "``version``."
        )
    )

    @classmethod
    def from_record(cls, record: AuditRecord) -> Self:
        """As it was kept."""
        return cls.from_value(record, details=json.loads(record.details))


@row_of(OdometryRecord)
class OdometryRow(Row):
    """Pose in ``map`` (m, rad), speed (m/s, rad/s) and speed limit of a robot."""


@row_of(ReadingRecord)
class Reading(Row):
    """One reading: the sensor's own fields by name ([mqtt.md](mqtt.md))."""


@row_of(MeasurementRecord)
class Measurement(Row):
    """One number of other equipment, as it was kept."""


# --- decisions ------------------------------------------------------------------------


class DecisionLink(Model):
    """One link of the chain of evidence.

    ``late`` is over 1 s, ``missing`` not within 2 s. An ``open`` link may still come,
    for 2 s at most, in the history too. ``unknown``: iVeg was interrupted while the
    link was open.

    Attributes:
        link: Its name; a last link ``interrupted`` says that iVeg was interrupted, with
            the time when that was found.
        at: When.
        value: What was measured.
        verdict: ``ok``, ``late``, ``missing``, ``n/a``, ``open`` or ``unknown``, see
            above.
    """

    link: str = ""
    at: Stamp | None = None
    value: JsonValue = None
    verdict: str = ""


@row_of(DecisionRecord)
class Decision(Row):
    """One decision: detection, observer, rule, and the robot's reaction.

    Why one robot was slowed: who was seen by whom, which rule fired, when the robot
    obeyed. ``rule_parameters`` has the numbers of the rule, poses of the robot and its
    observer (``places``) and, of older decisions of a laser alone, an ``obstacle``.

    Attributes:
        links: The chain of evidence.
        sentence: The sentence that the log used.
    """

    links: list[DecisionLink]
    sentence: Sentence

    @classmethod
    def from_record(cls, record: DecisionRecord) -> Self:
        """One decision, from memory or from the history."""
        return cls.from_value(record, sentence=sentence_of(record))


def sentence_of(record: DecisionRecord) -> Sentence:
    """Sentence that the log used when it happened."""
    is_walker = record.reason == "person" and record.confidence is None
    reason = "walker" if is_walker else record.reason or "default"
    if record.kind == "alert":
        key = "log.person_seen"
    elif record.in_sight is False:
        key = f"log.speed_down.{reason}_nlos"
    else:
        key = f"log.speed_down.{reason}"
    slots: Slots = {
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
    return Sentence(key=key, slots=slots)


# --- one day --------------------------------------------------------------------------


class Worked(Model):
    """Minutes that one robot drove in one aisle.

    Attributes:
        lane: Where and who.
        robot_id: Where and who.
    """

    lane: str
    robot_id: str
    minutes: Tenth


class Slowed(Model):
    """Minutes of robots slowed, by what slowed them and the aisle that it was in."""

    cause: str = Field(description="``person`` or ``robot``.")
    lane: str | None = Field(description="Null: outside the aisles, or unknown.")
    minutes: Tenth


class Encounters(Model):
    """Number of times that robots came to the zone of a person on that day.

    Counted by the decisions of the history.

    Attributes:
        count: Encounters.
    """

    count: int
    slowed: int = Field(description="Of which the robot said that it was slow.")


class Pass(Model):
    """A moving robot near a person, by means over a second.

    Attributes:
        at: When.
        robot_id: Who.
        speed: Of the robot (m/s).
        lane: Aisle.
    """

    at: Stamp
    robot_id: str
    distance_m: Hundredth = Field(description="Between the middles of both.")
    speed: Hundredth
    lane: str | None


class Day(Model):
    """Summary of one day of the fleet (Europe/Madrid), and what is due on the next.

    Poses are means over a second.

    Attributes:
        since: Its range; ``until`` is now while it goes on.
        robots: Who took part.
        worked: Minutes in each aisle.
        slowed: Minutes of limited speed.
        encounters: How often a robot came to the zone of a person.
        map: The greenhouse.
    """

    day: str = Field(description="ISO date.")
    since: Stamp
    until: Stamp = Field(
        description="The end of the day, or the moment of asking while it goes on."
    )
    robots: list[str]
    worked: list[Worked]
    slowed: list[Slowed]
    encounters: Encounters
    passes: list[Pass] = Field(description="The nearest, nearest first.")
    stops: list[Command] = Field(description="STOPs, oldest first.")
    unseen: int = Field(description="P1s that nobody has acknowledged.")
    lost: list[Literal["places", "telemetry"]] = Field(
        description=(
            "What of the day is no longer kept: places of people (no passes, no aisles "
            "of causes) or odometry and detections (nothing worked, no passes)."
        )
    )
    map: GreenhouseMap
