"""A robot of the fleet, with the age of everything that is said of it."""

from typing import Any, Literal, Self, get_type_hints

from pydantic import Field, create_model

from iveg.domain import feedback, fleet, goals, margins, observations, situation
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
    members_of,
    with_fields,
)
from iveg.models.command import Command


class SensorReading(Model):
    """The newest reading of a small sensor; its quantities by name."""

    age_s: Tenth | None


def _reading_model(reading: type[observations.Observation]) -> type[SensorReading]:
    """The model of a small sensor: the quantities of its observation, and its age."""
    types = get_type_hints(reading)
    members: dict[str, Any] = {
        name: (types[name], Field(description=f"{quantity.meaning} ({quantity.unit})"))
        for name, quantity in quantities_of(reading).items()
    }
    return create_model(
        reading.__name__, __base__=SensorReading, __doc__=reading.__doc__, **members
    )


READINGS = {kind.name: _reading_model(kind.type_) for kind in SENSED}


def newest_reading(robot: RobotState, kind: Kind, now: Instant) -> SensorReading | None:
    """Newest reading of a small sensor; None before the first."""
    read = robot.sensed.get(kind.type_)
    if read is None:
        return None
    age_s = None if read.at is None else now.mono - read.at.mono
    return READINGS[kind.name](**value_of(read.observation), age_s=age_s)


@members_of(margins.SafetyMargin, "robot_id", "person_id")
class Margin(Model):
    """Distance to a person less the stopping distance; shown, never acted on.

    Distance to a person less the stopping distance (S_p of ISO 13855). It is the least
    of a robot; it is shown and never acted on.

    ``band`` is ``unknown`` when the pose is older than 1.5 s, or when the detection is
    and the person may be nearer than 1 m by now. For a person farther away
    ``margin_m`` is the least possible.

    Attributes:
        robot_id: The pair.
        person_id: The pair.
        gap_m: Between surfaces (m).
        needs_m: S_p (m).
        margin_m: Gap less S_p (m).
        band: ``clear`` from 1 m, ``tight`` from 0, ``inside`` below 0; ``unknown``, see
            above.
        age_s: Age of the older position (s).
    """

    gap_m: Hundredth
    needs_m: Hundredth
    margin_m: Hundredth
    band: margins.Band
    age_s: Thousandth

    @classmethod
    def from_margin(cls, margin: margins.SafetyMargin | None) -> Self | None:
        """Margin between a robot and a person; None where there is no pair."""
        return None if margin is None else cls.from_value(margin)


@members_of(
    situation.Situation,
    "level",
    "kind",
    "state",
    "cause",
    "why",
    "about",
    "action",
    "factor",
)
class Situation(Model):
    """Gravest situation of a robot, with the action open to a person.

    Gravest situation of a robot, with the action open to a person
    ([dashboard.md](../dashboard.md#situation)). All displays of a robot's state use it.

    Sentences are in ``iveg/static/i18n``. A program that shows it later must age it: a
    robot silent for a second is ``late``, after three ``lost``, and no longer
    ``working`` or ``locked``.

    Attributes:
        level: Gravest level that holds for it.
        kind: The first kind, in their fixed order, that holds for it.
        state: Its sentence is ``situation.is.{state}``.
        cause: The reason that is applied.
        why: Its sentence is ``situation.why.{why}``.
        about: The person, robot or hold of the cause.
        action: Its sentence is ``situation.do.{action}``.
        factor: The strictest speed factor in force.
        slots: Values of the sentences: ``distance`` (m), ``lane``, ``factor``,
            ``seconds``, ``age`` (s), ``about``, ``code``, ``by``, ``boot``, ``level``
            (0–1).
    """

    slots: Slots


@members_of(feedback.SpeedLimit, "speed_factor", "reason", "cause", "decision_id")
class SpeedLimit(Model):
    """Greatest speed factor of a robot, and its reason.

    Attributes:
        speed_factor: The limit (0–1).
        reason: ``clear``, ``person``, ``robot``, ``doubt``, ``stale`` or
            ``unsupervised``.
        cause: Id of the person or robot.
        distance_m: From the robot to the centre of the zone (m).
        decision_id: The decision behind it.
        foretold_s: Until it reaches the zone of the cause; null: it is inside.
    """

    distance_m: Thousandth | None
    foretold_s: Thousandth | None


class Encounter(Model):
    """A zone that the robot will reach (docs/safety.md, "Foresight").

    A zone that the robot will reach at the present motion of both, or at its earlier
    speed if it is slow ([safety.md](../safety.md), "Foresight"). A forecast older than
    a second is left out.

    Attributes:
        cause: Id of the person or robot.
        reason: ``person`` or ``robot``.
        in_s: Time to it (s).
        probability: Share of forecasts this far ahead that came true.
        place: Where the robot will be.
        centre: Where the zone's centre will be.
        radius_m: Radius of the zone (m).
    """

    cause: str
    reason: str
    in_s: Tenth
    probability: Hundredth
    place: Point
    centre: Point
    radius_m: Hundredth

    @classmethod
    def from_encounter(cls, encounter: foresight.Encounter, now: Instant) -> Self:
        """An encounter, with the time that is left at this moment."""
        left_s = encounter.left_s(now)
        centre = Point(x=round(encounter.centre_x, 2), y=round(encounter.centre_y, 2))
        return cls.from_value(
            encounter.zone,
            in_s=left_s,
            probability=foresight.probability(left_s),
            place=Point(x=round(encounter.x, 2), y=round(encounter.y, 2)),
            centre=centre,
        )


class MissingPremise(Model):
    """One thing without which a robot is not clear (docs/safety.md, "Clear").

    Attributes:
        premise: Unmet condition.
        robot_id: Whose pose, word or detector it is.
    """

    premise: Literal["pose", "doubt", "detector"]
    robot_id: str


@members_of(goals.FollowedGoal, "robot_id", "aisle", "by", "state", "why")
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
        state: State of the goal, see above.
        why: Code of the robot's refusal or of its end.
        sent_at: When it was given.
        answered_at: The robot's first word of it.
        ended_at: When it came to its last state.
        forgotten_at: When the robot itself first said that it drives there no longer.
    """

    goal_id: str
    kind: goals.GoalKind
    x: float
    y: float
    sent_at: Stamp
    answered_at: Stamp | None
    ended_at: Stamp | None
    forgotten_at: Stamp | None

    @classmethod
    def from_goal(cls, followed: goals.FollowedGoal) -> Self:
        """A goal at its newest step."""
        return cls.from_value(
            followed,
            goal_id=followed.goal.goal_id,
            kind=followed.goal.kind,
            x=followed.goal.x,
            y=followed.goal.y,
            sent_at=followed.sent,
            answered_at=followed.answered,
            ended_at=followed.ended,
            forgotten_at=followed.forgotten,
        )


@members_of(observations.Hold, "id", "source", "ack")
class Hold(Model):
    """A reason why a robot may not move.

    Attributes:
        id: ULID of a STOP, or the robot's own.
        source: Where it comes from.
        ack: Who may lift it: ``remote``, ``local``, ``auto``.
    """


@members_of(observations.RobotFault, "code", "about", "for_s")
class Fault(Model):
    """A fault of a robot's own data, as the robot reports it.

    Attributes:
        code: Such as ``no_transform``.
        about: Such as ``map → odom``.
        for_s: How long (s).
    """


@members_of(observations.ReportedObstacle, "x", "y", "width_m", "moved")
class SeenObstacle(Model):
    """Obstacle that a robot's laser sees and nothing explains, in ``map`` (m).

    Attributes:
        x: Its middle in ``map`` (m).
        y: Its middle in ``map`` (m).
        width_m: From its first return to its last (m).
        moved: It walks, or has walked since it was seen first.
    """


@members_of(observations.SafetyReport, "reason", "cause", "feedback_age_s")
class Applied(Model):
    """Limit that the robot reports to apply.

    Attributes:
        reason: ``clear``, ``person``, ``robot``, ``stale``, ``doubt``,
            ``unsupervised``, ``hold``, ``watchdog``, ``obstacle``.
        cause: Id of the person, robot or hold.
        age_s: Of the report (s).
        feedback_age_s: Of the feedback that the robot had (s).
        faults: Faults of its own data.
        obstacle: Obstacle of its laser that nothing explains.
    """

    age_s: Thousandth
    faults: list[Fault]
    obstacle: SeenObstacle | None

    @classmethod
    def from_robot(cls, robot: RobotState, now: Instant) -> Self | None:
        """Limit of the robot's newest report; None before the first."""
        report, received = robot.safety, robot.safety_received
        if report is None or received is None:
            return None
        return cls.from_value(report, age_s=now.mono - received.mono)


Mode = Literal["RUNNING", "SLOW", "STOPPED"]


class Detector(Model):
    """Whether the robot's pictures are read whole, and required.

    Attributes:
        required: By the fleet file, and not out of service.
        missing: Nothing proves now that it works.
        out_by: Who took it out of service.
        out_since: When.
        out_reason: Why.
    """

    required: bool
    missing: bool
    out_by: str | None
    out_since: Stamp | None
    out_reason: str | None

    @classmethod
    def from_robot(cls, robot: RobotState, now: Instant) -> Self:
        """State of a robot's detector at this moment."""
        out = robot.detector.out_of_service
        return cls(
            # A detector that was taken out of service is waited for by nobody.
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
    def from_robot(cls, robot: RobotState) -> Self | None:
        """Intent that the robot reports; None without one."""
        intent = robot.navigation
        if intent is None:
            return None
        goal = (
            None if intent.goal is None else Point(x=intent.goal[0], y=intent.goal[1])
        )
        return cls.from_value(intent, goal=goal)


@members_of(
    fleet.RobotProfile, "drive", "length", "width", "max_speed", "turning_radius"
)
class Profile(Model):
    """Known properties of the robot (m, m/s).

    Attributes:
        drive: Its steering.
        length: Footprint (m).
        width: Footprint (m).
        max_speed: Greatest speed (m/s).
        turning_radius: Least turning radius (m).
    """


@with_fields({name: (made | None, ...) for name, made in READINGS.items()})
class Robot(Model):
    """One robot with the age of its data.

    ``mode`` is ``STOPPED`` when the robot says so (a hold or factor 0 in a report of at
    most 1.5 s ago) or it is STANDING, never by an order alone. Without such
    a report ``mode`` follows the speed limit.

    Attributes:
        robot_id: The robot; also its entity at Orion.
        link: Age of the pose ([safety.md](../safety.md), "Age").
        situation: Its gravest situation, with the action open to a person.
        mode: The robot's recent report; without one, the speed limit.
        pose: Of ``base_link`` in ``map`` (m, rad).
        lane: The aisle that it is in.
        twist: Measured speed (m/s, rad/s).
        stamp: As the robot sent it.
        received_at: When iVeg took it.
        age_s: At most; null: unknown.
        age_estimated: The robot echoes no feedback, so its age is an estimate (≈).
        speed_factor: Speed factor that the robot reports to apply.
        applied: The robot's newest safety report.
        speed_limit: The speed limit that iVeg tells the robot.
        encounters: Zones that it will reach within three seconds, soonest first.
        missing: Unmet conditions of "clear", its reason first.
        detector: Whether its pictures are read, and required.
        refused: A setting excludes its messages.
        holds: Why it may not move.
        stop: The open STOP. Each try changes ``tries`` and ``transports``, also while
            the robot is silent.
        stop_state: ``RUNNING``, or one of the nine states of [safety.md](../safety.md).
        navigation: Its intent.
        goal: Newest goal that a person gave it.
        replay: It plays a recording.
        clock_offset_s: Robot's clock less the server's; for display (s).
        transport: Transport that feeds the pose.
        profile: Its body, as far as known.
        margin: Its least margin to a person.
        cmd_status: The agent's opinion, never believed.
    """

    robot_id: str
    link: Link
    situation: Situation
    mode: Mode
    pose: Pose | None
    lane: str | None
    twist: Twist | None
    stamp: str | None
    received_at: Stamp | None
    age_s: Thousandth | None
    age_estimated: bool
    speed_factor: float | None
    applied: Applied | None
    speed_limit: SpeedLimit
    encounters: list[Encounter]
    missing: list[MissingPremise]
    detector: Detector
    refused: bool
    holds: list[Hold]
    stop: Command | None
    stop_state: str
    navigation: Navigation | None
    goal: Goal | None
    replay: bool
    clock_offset_s: Thousandth | None
    transport: TransportId
    profile: Profile
    margin: Margin | None
    cmd_status: str | None

    @staticmethod
    def sensed(robot: RobotState, now: Instant) -> dict[str, SensorReading | None]:
        """The members that are small sensors' newest readings."""
        return {kind.name: newest_reading(robot, kind, now) for kind in SENSED}
