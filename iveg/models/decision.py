"""Why one robot was slowed: each link from the detection to the robot's own report."""

from typing import Literal

from pydantic import Field, JsonValue

from iveg.domain.records import DecisionRecord, Json
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, Position, stamp
from iveg.models.command import Sentence


class DecisionRule(Model):
    """The rule that fired, as it was at that moment.

    Attributes:
        id: The rule.
        version: The rule.
        parameters: Its values; ``obstacle``, of older decisions for which only a laser
            saw why: ``size_m``, ``gap_m`` (from the outline, m), ``moved``, ``over_s``
            (for how long it was seen), else null.
    """

    id: str | None
    version: str | None
    parameters: JsonValue


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
            below.
    """

    link: str
    at: str | None
    value: JsonValue
    verdict: str


class DecisionPlace(Model):
    """Pose of a robot when a decision began, in ``map`` (m, rad).

    Attributes:
        robot_id: The robot.
        x: In ``map`` (m).
        y: In ``map`` (m).
        yaw: Heading (rad).
    """

    robot_id: str
    x: float
    y: float
    yaw: float


class Decision(Model):
    """One decision: detection, observer, rule, and the robot's reaction.

    Why one robot was slowed: who was seen by whom, which rule fired, when the robot
    obeyed.

    Attributes:
        decision_id: ULID.
        robot_id: The robot that was limited.
        person_id: The track.
        observer: Robot that saw it.
        class_: Canonical class and the detector's word.
        class_id: Canonical class and the detector's word.
        confidence: Of the detection; null where none is behind it, as of whom only a
            laser saw (0–1).
        position: In ``map``; not in the CSV (m).
        y: The same, under the names of the CSV (m).
        z: The same, under the names of the CSV (m).
        speed_factor: The limit (0–1).
        reason: ``person``, ``robot``, ``stale``.
        rule: The rule that fired; not in the CSV.
        rule_version: The same, under the names of the CSV.
        in_sight: Whether the robot could see them itself.
        started_at: Decided.
        feedback_at: Published, reported by the robot, seen in its speed, over; null:
            not yet.
        applied_at: Published, reported by the robot, seen in its speed, over; null: not
            yet.
        observed_at: Published, reported by the robot, seen in its speed, over; null:
            not yet.
        ended_at: Published, reported by the robot, seen in its speed, over; null: not
            yet.
        speed_after: Measured at ``started_at``; at ``observed_at`` (m/s).
        links: The chain of evidence.
        sentence: The sentence that the log used.
    """

    decision_id: str
    kind: Literal["alert", "mandate"]
    robot_id: str
    person_id: str | None
    observer: str | None
    class_: str | None = Field(validation_alias="class", serialization_alias="class")
    class_id: str | None
    confidence: float | None
    position: Position | None
    x: float | None = Field(
        description="As in ``position``, under the name of the CSV; so ``y``, ``z``."
    )
    y: float | None
    z: float | None
    distance_m: float | None = Field(
        description="From the robot to the centre of the ring."
    )
    speed_factor: float | None
    reason: str | None
    rule: DecisionRule
    rule_id: str | None = Field(
        description="As in ``rule``, under the name of the CSV; so the two below."
    )
    rule_version: str | None
    rule_parameters: JsonValue = Field(
        description="With ``places``, as they are stored."
    )
    in_sight: bool | None
    started_at: str
    feedback_at: str | None
    applied_at: str | None
    observed_at: str | None
    ended_at: str | None
    speed_before: float | None = Field(description="m/s, measured at ``started_at``.")
    speed_after: float | None
    links: list[DecisionLink]
    sentence: Sentence
    places: list[DecisionPlace] = Field(
        description=(
            "Poses of the robot and its observer; empty for those of the earlier "
            "version."
        )
    )

    @classmethod
    def of_record(cls, record: DecisionRecord) -> "Decision":
        """One decision, from memory or from the history."""
        parameters = dict(record.rule_parameters)
        places = parameters.pop("places", [])
        return cls(
            decision_id=record.decision_id,
            kind=record.kind,
            robot_id=record.robot_id,
            person_id=record.person_id,
            observer=record.observer,
            class_=record.class_,
            class_id=record.class_id,
            confidence=record.confidence,
            position=Position.of_record(record),
            x=record.x,
            y=record.y,
            z=record.z,
            distance_m=record.distance_m,
            speed_factor=record.speed_factor,
            reason=record.reason,
            rule=DecisionRule(
                id=record.rule_id,
                version=record.rule_version,
                parameters=parameters,
            ),
            rule_id=record.rule_id,
            rule_version=record.rule_version,
            rule_parameters=dict(record.rule_parameters),
            in_sight=record.in_sight,
            started_at=format_stamp(record.started_at),
            feedback_at=stamp(record.feedback_at),
            applied_at=stamp(record.applied_at),
            observed_at=stamp(record.observed_at),
            ended_at=stamp(record.ended_at),
            speed_before=record.speed_before,
            speed_after=record.speed_after,
            links=[_link(one) for one in record.links],
            sentence=sentence_of(record),
            places=[DecisionPlace.model_validate(one) for one in places],
        )


def sentence_of(record: DecisionRecord) -> Sentence:
    """The same sentence that the log used when it happened."""
    is_walker = record.reason == "person" and record.confidence is None
    reason = "walker" if is_walker else record.reason or "default"
    if record.kind == "alert":
        key = "log.person_seen"
    elif record.in_sight is False:
        key = f"log.speed_down.{reason}_nlos"
    else:
        key = f"log.speed_down.{reason}"
    return Sentence(
        key=key,
        slots={
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
        },
    )


def _link(link: Json) -> DecisionLink:
    return DecisionLink(
        link=str(link.get("link")),
        at=stamp(link.get("at")),
        value=link.get("value"),
        verdict=str(link.get("verdict")),
    )
