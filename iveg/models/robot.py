"""A robot of the fleet, with the age of everything that is said of it."""

from typing import TYPE_CHECKING, Literal

from pydantic import Field, create_model

from iveg.domain.fleet import RobotProfile
from iveg.domain.kinds import SENSED
from iveg.domain.observations import Instant
from iveg.domain.robot_state import Link, RobotState
from iveg.domain.stamps import format_stamp
from iveg.domain.transports import TransportId
from iveg.models.applied import Applied, Hold
from iveg.models.base import Model
from iveg.models.camera_bias import CameraBias
from iveg.models.command import Command
from iveg.models.goal import Goal
from iveg.models.margin import Margin
from iveg.models.places import Point
from iveg.models.pose import Pose, Twist
from iveg.models.robot_access import Revoked
from iveg.models.sensor_reading import READINGS, SensorReading, newest_reading
from iveg.models.situation import Situation
from iveg.models.speed_limit import Encounter, MissingPremise, SpeedLimit

Mode = Literal["RUNNING", "SLOW", "STOPPED"]


class Detector(Model):
    """Whether the robot's pictures are read whole, and waited for."""

    required: bool = Field(description="By the fleet file, and not out of service.")
    missing: bool
    out_by: str | None = Field(description="Who took it out of service.")
    out_since: str | None
    bias: CameraBias | None

    @classmethod
    def of(cls, robot: RobotState, now: Instant) -> "Detector":
        """At this moment."""
        out = robot.detector.out_of_service
        return cls(
            required=robot.description.has_detector and out is None,
            missing=robot.detector.is_missing(now),
            out_by=None if out is None else out.by,
            out_since=None if out is None else format_stamp(out.since),
            bias=CameraBias.of(robot.detector.peer_looks, now),
        )


class Navigation(Model):
    """The robot's intent, in ``map`` (m)."""

    task: str
    goal: Point | None
    path: list[tuple[float, float]]

    @classmethod
    def of(cls, robot: RobotState) -> "Navigation | None":
        """Intent that the robot reports; None without one."""
        intent = robot.navigation
        if intent is None:
            return None
        goal = intent.goal
        return cls(
            task=intent.task,
            goal=None if goal is None else Point(x=goal[0], y=goal[1]),
            path=list(intent.path),
        )


class Profile(Model):
    """Known properties of the robot (m, m/s)."""

    drive: str
    length: float
    width: float
    max_speed: float
    turning_radius: float

    @classmethod
    def of(cls, body: RobotProfile) -> "Profile":
        """The body of a robot."""
        return cls(
            drive=body.drive,
            length=body.length,
            width=body.width,
            max_speed=body.max_speed,
            turning_radius=body.turning_radius,
        )


class _Robot(Model):
    """One robot with the age of what is said of it."""

    robot_id: str
    link: Link
    situation: Situation
    mode: Mode = Field(
        description="The robot's recent report; without one, the speed limit."
    )
    pose: Pose | None
    twist: Twist | None
    stamp: str | None = Field(description="As the robot sent it.")
    received_at: str | None
    age_s: float | None = Field(description="At most; null while nobody knows.")
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
    revoked: Revoked | None = Field(description="Null: it is heard.")
    holds: list[Hold]
    stop: Command | None
    stop_state: str
    navigation: Navigation | None
    goal: Goal | None = Field(description="The newest that a person gave it.")
    replay: bool
    clock_offset_s: float | None
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
