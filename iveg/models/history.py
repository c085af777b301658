"""Rows of the history as REST, NDJSON and pages have them, and one day."""

from typing import Self

from pydantic import Json, JsonValue

from iveg.domain import day
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
    members_of,
    row_of,
)
from iveg.models.command import Command, Sentence


@row_of(AlertRecord)
class Alert(Row):
    """An alert to people: all occurrences of one kind and subject as one.

    A notice to people (ISA-18.2). One condition (kind and subject) that is back within
    10 minutes is the same alert, once more; each time it sounds and asks to be
    acknowledged anew. A condition that gets graver is raised anew at once. Its end and
    acknowledgement are those of the newest time.

    Attributes:
        slots: Values of its sentence.
    """

    slots: Slots

    @classmethod
    def from_alert(cls, alert: BookedAlert) -> Self:
        """One alert as it is now."""
        return cls.from_value(write_alert(alert))


class AcknowledgedAlerts(Model):
    """Outcome of alerts that somebody acknowledged together.

    Attributes:
        items: Alerts that this acknowledged.
        left: Other ids: P1s, acknowledged and unknown alerts.
    """

    items: list[Alert]
    left: list[str]


@row_of(LogRecord)
class LogEntry(Row):
    """One line of the action and inference log.

    Attributes:
        slots: Values of its sentence.
    """

    slots: Slots


@members_of(LogRecord, "robot_id", "decision_id")
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
    """One row of the audit.

    Attributes:
        details: ``status`` of the answer, and the request; of a rule the new
            ``version``.
    """

    details: Json[dict[str, JsonValue]]


@row_of(OdometryRecord)
class OdometryRow(Row):
    """Pose in ``map`` (m, rad), speed (m/s, rad/s) and speed limit of a robot."""


@row_of(ReadingRecord)
class Reading(Row):
    """One reading: the sensor's own fields by name ([mqtt.md](mqtt.md))."""


@row_of(MeasurementRecord)
class Measurement(Row):
    """One stored number of other equipment."""


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
        value: Measured value.
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
    # Only a laser track is a person without the confidence of a detector.
    is_laser_track = record.reason == "person" and record.confidence is None
    reason = "walker" if is_laser_track else record.reason or "default"
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
    """Minutes of robots slowed, by what slowed them and the aisle that it was in.

    Attributes:
        cause: ``person`` or ``robot``.
        lane: Null: outside the aisles, or unknown.
    """

    cause: str
    lane: str | None
    minutes: Tenth


@members_of(day.EncounterCounts, "count", "slowed")
class Encounters(Model):
    """Number of times that robots came to the zone of a person on that day.

    Counted by the decisions of the history.

    Attributes:
        count: Encounters.
        slowed: Encounters in which the robot reported that it was slow.
    """


@members_of(day.Passing, "robot_id", "lane")
class Pass(Model):
    """A moving robot near a person, by means over a second.

    Attributes:
        at: When.
        robot_id: Who.
        distance_m: Between the middles of both.
        speed: Of the robot (m/s).
        lane: Aisle.
    """

    at: Stamp
    distance_m: Hundredth
    speed: Hundredth


class Day(Model):
    """Summary of one day of the fleet (Europe/Madrid), and what is due on the next.

    Poses are means over a second.

    Attributes:
        day: ISO date.
        since: Its range; ``until`` is now while it goes on.
        until: The end of the day, or the moment of asking while it goes on.
        robots: Who took part.
        worked: Minutes in each aisle.
        slowed: Minutes of limited speed.
        encounters: Times that a robot came to the zone of a person.
        passes: The nearest, nearest first.
        stops: STOPs, oldest first.
        unseen: P1s that nobody has acknowledged.
        map: The greenhouse.
    """

    day: str
    since: Stamp
    until: Stamp
    robots: list[str]
    worked: list[Worked]
    slowed: list[Slowed]
    encounters: Encounters
    passes: list[Pass]
    stops: list[Command]
    unseen: int
    map: GreenhouseMap
