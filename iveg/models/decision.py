"""Why one robot was slowed: each link from the detection to the robot's own report."""

from typing import Literal

from pydantic import Field, JsonValue

from iveg.domain.records import DecisionRecord, Json
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model, stamp
from iveg.models.command import Sentence
from iveg.models.places import Position


class DecisionRule(Model):
    """The rule that fired, as it was at that moment."""

    id: str | None
    version: str | None
    parameters: JsonValue


class DecisionLink(Model):
    """One link of the chain of evidence."""

    link: str
    at: str | None
    value: JsonValue
    verdict: str


class DecisionPlace(Model):
    """Pose of a robot when a decision began, in ``map`` (m, rad)."""

    robot_id: str
    x: float
    y: float
    yaw: float


class Decision(Model):
    """One decision: detection, observer, rule, and the robot's reaction."""

    decision_id: str
    kind: Literal["alert", "mandate", "late"] = Field(
        description="`late`: made afterwards of what a robot kept during a gap."
    )
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
    speed_before: float | None = Field(
        description="m/s, the greatest of the second before ``started_at``."
    )
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
    elif record.kind == "late":
        key = "decision.late"
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
