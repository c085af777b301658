"""A robot of the fleet, with the age of everything that is said of it."""

from typing import TYPE_CHECKING, Any, Literal, Self, get_type_hints

from pydantic import Field, create_model

from iveg.domain import goals, margins, situation
from iveg.domain.kinds import SENSED, Kind
from iveg.domain.observations import Instant
from iveg.domain.quantities import quantities_of, value_of
from iveg.domain.robot_state import Link, RobotState
from iveg.domain.rule import foresight
from iveg.domain.stamps import format_stamp
from iveg.domain.transports import TransportId
from iveg.models.base import (
    Hundredth,
    Model,
    Point,
    Pose,
    Slots,
    Stamp,
    Tenth,
    Thousandth,
    Twist,
)
from iveg.models.command import Command


class SensorReading(Model):
    """The newest reading of a small sensor; its quantities by name."""

    age_s: Tenth | None


def _reading_model(kind: Kind) -> type[SensorReading]:
    """The model of a small sensor: the quantities of its observation, and its age."""
    types = get_type_hints(kind.of)
    members: dict[str, Any] = {
        name: (types[name], Field(description=f"{one.meaning} ({one.unit})"))
        for name, one in quantities_of(kind.of).items()
    }
    return create_model(
        kind.of.__name__, __base__=SensorReading, __doc__=kind.of.__doc__, **members
    )


READINGS = {kind.name: _reading_model(kind) for kind in SENSED}


def newest_reading(robot: RobotState, kind: Kind, now: Instant) -> SensorReading | None:
    """Newest reading of a small sensor; None before the first."""
    read = robot.sensed.get(kind.of)
    if read is None:
        return None
    age_s = None if read.at is None else now.mono - read.at.mono
    return READINGS[kind.name](**value_of(read.observation), age_s=age_s)


class Margin(Model):
    """The gap to a person less what stopping takes; shown, never acted on.

    The gap to a person less what stopping takes (S_p of ISO 13855). It is the least of
    a robot; it is shown and never acted on.

    ``band`` is ``unknown`` when the pose is older than 1.5 s, or when the detection is
    and the person may be nearer than 1 m by now. Of a person who is farther away,
    ``margin_m`` is the least that is left.

    Attributes:
        robot_id: The pair.
        person_id: The pair.
        needs_m: S_p (m).
        margin_m: Gap less S_p (m).
        band: ``clear`` from 1 m, ``tight`` from 0, ``inside`` below 0; ``unknown``, see
            below.
    """

    robot_id: str
    person_id: str
    gap_m: Hundredth = Field(description="Between surfaces.")
    needs_m: Hundredth
    margin_m: Hundredth
    band: margins.Band
    age_s: Thousandth = Field(description="Age of the older position.")

    @classmethod
    def of(cls, margin: margins.SafetyMargin | None) -> Self | None:
        """Margin between a robot and a person; None where there is no pair."""
        return None if margin is None else cls.from_value(margin)


class Situation(Model):
    """The worst that holds for a robot now, and what a person can do.

    What holds for a robot now, and what a person can do
    ([dashboard.md](../dashboard.md#situation)). Everything that says how a robot is
    takes it from here.

    Sentences are in ``iveg/static/i18n``. Who shows it later lets it grow old: a robot
    that has not been heard for a second is ``late``, after three ``lost``, and never
    again ``working`` or ``locked``.

    Attributes:
        slots: Values of the sentences: ``distance`` (m), ``lane``, ``factor``,
            ``seconds``, ``age`` (s), ``about``, ``code``, ``by``, ``boot``, ``level``
            (0–1).
    """

    level: situation.Level = Field(description="Of the gravest that holds for it.")
    kind: situation.Kind = Field(
        description="What is told: the first of all that holds."
    )
    state: str = Field(description="Its sentence is `situation.is.{state}`.")
    cause: str = Field(description="The reason that is applied.")
    why: str | None = Field(description="Its sentence is `situation.why.{why}`.")
    about: str | None = Field(description="The person, robot or hold of the cause.")
    action: situation.Action = Field(
        description="Its sentence is `situation.do.{action}`."
    )
    factor: float | None = Field(description="The strictest speed factor in force.")
    slots: Slots


class SpeedLimit(Model):
    """Greatest speed factor of a robot, and its reason.

    Attributes:
        speed_factor: The limit (0–1).
        reason: ``clear``, ``person``, ``robot``, ``doubt``, ``stale`` or
            ``unsupervised``.
        cause: Id of the person or robot.
        distance_m: From the robot to the centre of the zone (m).
        decision_id: The decision behind it.
    """

    speed_factor: float
    reason: str
    cause: str | None
    distance_m: Thousandth | None
    decision_id: str | None
    foretold_s: Thousandth | None = Field(
        description="Until it reaches the zone of the cause; null: it is inside."
    )


class Encounter(Model):
    """A zone that the robot will reach (docs/safety.md, "Foresight").

    A zone that the robot will reach, as it and the person or peer go now, or once it is
    let go, if it is slow ([safety.md](../safety.md), "Foresight"). Nothing has happened
    yet; a forecast older than a second is left out.

    Attributes:
        cause: Id of the person or robot.
        reason: ``person`` or ``robot``.
        in_s: How soon (s).
        radius_m: Radius of the zone (m).
    """

    cause: str
    reason: str
    in_s: Tenth
    probability: Hundredth = Field(
        description="Share of encounters foretold so far ahead that came true."
    )
    place: Point = Field(description="Where the robot will be.")
    centre: Point = Field(description="Where the zone's centre will be.")
    radius_m: Hundredth

    @classmethod
    def of(cls, foretold: foresight.Encounter, now: Instant) -> Self:
        """At this moment."""
        left_s = foretold.left_s(now)
        centre = Point(x=round(foretold.centre_x, 2), y=round(foretold.centre_y, 2))
        return cls.from_value(
            foretold.zone,
            in_s=left_s,
            probability=foresight.probability(left_s),
            place=Point(x=round(foretold.x, 2), y=round(foretold.y, 2)),
            centre=centre,
        )


class MissingPremise(Model):
    """One thing without which a robot is not clear (docs/safety.md, "Clear").

    Attributes:
        premise: What is missing.
    """

    premise: Literal["pose", "doubt", "detector"]
    robot_id: str = Field(description="Whose pose, word or detector it is.")


class Goal(Model):
    """A goal, in ``map`` (m).

    A goal that a person gave to a robot ([safety.md](../safety.md#goals)).

    ``UNCONFIRMED`` is a goal, or its cancellation, without an answer for 10 s; a late
    word of the robot still counts. ``DELETED`` was a STOP or another hold.

    Attributes:
        goal_id: ULID.
        robot_id: Whose.
        kind: What was asked for.
        x: The place in ``map`` (m).
        y: The place in ``map`` (m).
        aisle: Label of the lane, of ``aisle``.
        by: Who gave it.
        state: Below.
        why: Code of the robot's refusal or of what ended it.
        sent_at: When it was given.
        answered_at: The robot's first word of it.
        ended_at: When it came to its last state.
        forgotten_at: When the robot itself first said that it drives there no longer.
    """

    goal_id: str
    robot_id: str
    kind: goals.GoalKind
    x: float
    y: float
    aisle: str | None
    by: str
    state: goals.GoalState
    why: str | None
    sent_at: Stamp
    answered_at: Stamp | None
    ended_at: Stamp | None
    forgotten_at: Stamp | None

    @classmethod
    def of(cls, one: goals.FollowedGoal) -> Self:
        """At its newest step."""
        return cls.from_value(
            one,
            goal_id=one.goal.goal_id,
            kind=one.goal.kind,
            x=one.goal.x,
            y=one.goal.y,
            sent_at=one.sent,
            answered_at=one.answered,
            ended_at=one.ended,
            forgotten_at=one.forgotten,
        )


class Hold(Model):
    """A reason why a robot may not move.

    Attributes:
        id: ULID of a STOP, or the robot's own.
        source: ``iveg``, ``boot``, ``hw``, ``bumper``, ``link``.
        ack: Who may lift it: ``remote``, ``local``, ``auto``.
    """

    id: str
    source: str
    ack: str


class Fault(Model):
    """A fault of a robot's own data, as the robot reports it.

    Attributes:
        code: Such as ``no_transform``.
        about: Such as ``map → odom``.
        for_s: How long (s).
    """

    code: str
    about: str
    for_s: float | None


class SeenObstacle(Model):
    """Obstacle that a robot's laser sees and nothing explains, in ``map`` (m).

    Attributes:
        x: Its middle in ``map`` (m).
        y: Its middle in ``map`` (m).
        width_m: From its first return to its last (m).
        moved: It walks, or has walked since it was seen first.
    """

    x: float
    y: float
    width_m: float
    moved: bool


class Applied(Model):
    """Limit that the robot reports to apply.

    Attributes:
        reason: ``clear``, ``person``, ``robot``, ``stale``, ``doubt``,
            ``unsupervised``, ``hold``, ``watchdog``, ``obstacle``.
        cause: Id of the person, robot or hold.
        age_s: Of the report (s).
        feedback_age_s: Of the feedback that the robot had (s).
        faults: What the robot finds wrong with its data.
        obstacle: What its laser sees near it and nothing explains.
    """

    reason: str
    cause: str | None
    age_s: Thousandth
    feedback_age_s: float | None
    faults: list[Fault]
    obstacle: SeenObstacle | None

    @classmethod
    def of(cls, robot: RobotState, now: Instant) -> Self | None:
        """From its newest report; None before the first."""
        report, received = robot.safety, robot.safety_received
        if report is None or received is None:
            return None
        return cls.from_value(report, age_s=now.mono - received.mono)


Mode = Literal["RUNNING", "SLOW", "STOPPED"]


class Detector(Model):
    """Whether the robot's pictures are read whole, and waited for.

    Attributes:
        missing: Nothing proves now that it works.
        out_since: When.
        out_reason: Why.
    """

    required: bool = Field(description="By the fleet file, and not out of service.")
    missing: bool
    out_by: str | None = Field(description="Who took it out of service.")
    out_since: Stamp | None
    out_reason: str | None

    @classmethod
    def of(cls, robot: RobotState, now: Instant) -> Self:
        """At this moment."""
        out = robot.detector.out_of_service
        return cls(
            required=robot.description.has_detector and out is None,
            missing=robot.detector.is_missing(now),
            out_by=None if out is None else out.by,
            out_since=None if out is None else format_stamp(out.since),
            out_reason=None if out is None else out.reason,
        )


class Navigation(Model):
    """The robot's intent, in ``map`` (m).

    Attributes:
        task: Name of the task.
        goal: Where it goes (m).
        path: Planned path (m).
    """

    task: str
    goal: Point | None
    path: list[tuple[float, float]]

    @classmethod
    def of(cls, robot: RobotState) -> Self | None:
        """Intent that the robot reports; None without one."""
        intent = robot.navigation
        if intent is None:
            return None
        goal = (
            None if intent.goal is None else Point(x=intent.goal[0], y=intent.goal[1])
        )
        return cls.from_value(intent, goal=goal)


class Profile(Model):
    """Known properties of the robot (m, m/s).

    Attributes:
        drive: ``differential`` or ``ackermann``.
        length: Footprint (m).
        width: Footprint (m).
        max_speed: Greatest speed (m/s).
        turning_radius: Least turning radius (m).
    """

    drive: str
    length: float
    width: float
    max_speed: float
    turning_radius: float


class _Robot(Model):
    """One robot with the age of what is said of it.

    ``mode`` is ``STOPPED`` when the robot says so (a hold or factor 0 in a report of at
    most 1.5 s ago) or it is STANDING, never because it was asked to stop. Without such
    a report ``mode`` is what the robot was told.

    Attributes:
        robot_id: The robot; also its entity at Orion.
        link: Age of the pose ([safety.md](../safety.md), "Age").
        situation: How it stands with it, in one truth.
        pose: Of ``base_link`` in ``map`` (m, rad).
        twist: Measured speed (m/s, rad/s).
        received_at: When iVeg took it.
        age_estimated: The robot echoes no feedback, so its age is an estimate (≈).
        applied: The robot's newest safety report.
        speed_limit: The speed limit that iVeg tells the robot.
        detector: Whether its pictures are read, and waited for.
        holds: Why it may not move.
        stop: The STOP that is open. It is told again at each try: ``tries`` and
            ``transports`` count on while the robot is silent.
        stop_state: ``RUNNING``, or one of the nine states of [safety.md](../safety.md).
        navigation: Its intent.
        replay: It plays a recording.
        clock_offset_s: Robot's clock less the server's; for display (s).
        profile: What is known of its body.
        margin: Its least margin to a person.
    """

    robot_id: str
    link: Link
    situation: Situation
    mode: Mode = Field(
        description="The robot's recent report; without one, the speed limit."
    )
    pose: Pose | None
    lane: str | None = Field(description="The aisle that it is in.")
    twist: Twist | None
    stamp: str | None = Field(description="As the robot sent it.")
    received_at: Stamp | None
    age_s: Thousandth | None = Field(description="At most; null while nobody knows.")
    age_estimated: bool
    speed_factor: float | None = Field(
        description="Speed factor that the robot reports to apply."
    )
    applied: Applied | None
    speed_limit: SpeedLimit
    encounters: list[Encounter] = Field(
        description="Zones that it will reach within three seconds, the soonest first."
    )
    missing: list[MissingPremise] = Field(
        description='What "clear" lacks, its reason first.'
    )
    detector: Detector
    refused: bool = Field(description="A setting says that it is not heard.")
    holds: list[Hold]
    stop: Command | None
    stop_state: str
    navigation: Navigation | None
    goal: Goal | None = Field(description="The newest that a person gave it.")
    replay: bool
    clock_offset_s: Thousandth | None
    transport: TransportId = Field(description="Transport that feeds the pose.")
    profile: Profile
    margin: Margin | None
    cmd_status: str | None = Field(description="The agent's opinion, never believed.")

    @staticmethod
    def sensed(robot: RobotState, now: Instant) -> dict[str, SensorReading | None]:
        """The members that are small sensors' newest readings."""
        return {kind.name: newest_reading(robot, kind, now) for kind in SENSED}


if TYPE_CHECKING:
    Robot = _Robot
else:
    Robot = create_model(
        "Robot",
        __base__=_Robot,
        __doc__=_Robot.__doc__,
        **{name: (made | None, ...) for name, made in READINGS.items()},
    )
