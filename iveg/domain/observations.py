"""Observations: frozen values, each with its robot, its order and its age.

Each is the one declaration of its message: names on the wire, bounds and digits stand
at its members.  Names are those of ``nav_msgs``, ``sensor_msgs`` and the NGSI entity;
times are Unix seconds unless said otherwise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, Strict

from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.quantities import Quantity
from iveg.domain.transports import FIWARE, TransportId
from iveg.domain.wire import (
    IF_ANY,
    IN_MESSAGE,
    MAX_PATH,
    MAX_TEXT,
    OR_NONE,
    Count,
    Flag,
    MaxRange,
    Metres,
    Radians,
    Seconds,
    Share,
    Speed,
    Text,
    digits,
    one_of,
    place,
)

MOST_HEARD_ALSO = 3


@dataclass(frozen=True, slots=True)
class Instant:
    """One moment on both clocks.

    Deadlines and ages use ``mono``; ``wall`` is for people, logs and storage.
    """

    mono: float
    wall: float

    def later(self, seconds: float) -> "Instant":
        """The moment ``seconds`` after this one."""
        return Instant(self.mono + seconds, self.wall + seconds)


@dataclass(frozen=True, slots=True)
class FeedbackRef:
    """One feedback message of iVeg: its boot, and its place in the count."""

    boot: Text
    seq: Count


@dataclass(frozen=True, slots=True)
class Origin:
    """The count that orders a message (docs/interfaces/mqtt.md).

    Attributes:
        boot: Random, new at every start of the robot; None when the sender is silent.
        seq: One more for each message of a topic; None when the sender is silent.
        stamp: The robot's clock, exactly as sent; for display and clock offset only.
        stamp_s: The same as Unix seconds; None where it cannot be read.
        mono: The robot's monotonic seconds since this boot, one axis for all topics.
        acknowledgements: The sender tells what it has heard; its age can be proven.
        heard: The newest feedback that it had heard; None before the first.
        heard_also: The newest of every other author that it hears.
        replay: A recording is played: the name of the map frame that it is in, so that
            only recordings of one frame meet.  None: a live robot says this.
    """

    boot: Text | None = None
    seq: Count | None = None
    stamp: Text | None = None
    stamp_s: float | None = None
    mono: Seconds | None = None
    acknowledgements: bool = False
    heard: FeedbackRef | None = None
    heard_also: Annotated[
        tuple[FeedbackRef, ...], Field(max_length=MOST_HEARD_ALSO)
    ] = ()
    replay: Text | None = None

    @property
    def echoes(self) -> tuple[FeedbackRef, ...]:
        """The newest feedback of each author that the sender had heard."""
        return () if self.heard is None else (self.heard, *self.heard_also)

    @property
    def own_s(self) -> float | None:
        """The moment on the robot's own clock (s): the one that is never set, if told.

        Comparable among topics of one boot alone.
        """
        return self.stamp_s if self.mono is None else self.mono


UNKNOWN_ORIGIN = Origin()
"""Of an observation whose sender tells none, or before it is counted."""


@dataclass(frozen=True, slots=True)
class Observation:
    """Something that a robot or a device observed.

    Attributes:
        robot_id: Who says so; empty: no robot.
        origin: Which of its messages it was.
    """

    __pydantic_config__ = ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False)

    robot_id: str
    origin: Origin


def _or_none(text: str | None) -> str | None:
    return text or None


FrameName = Annotated[Text, AfterValidator(_or_none)]
"""As sent; empty: none."""


@dataclass(frozen=True, slots=True)
class Odometry(Observation):
    """Pose of ``base_link`` in ``map`` and the twist in ``base_link``.

    Attributes:
        frame_id: Of the pose, as sent; None: without one, which is ``map``.
    """

    pose: Annotated[Pose2D, IN_MESSAGE]
    twist: Annotated[Twist2D, IN_MESSAGE]
    frame_id: Annotated[FrameName | None, IF_ANY] = None


@dataclass(frozen=True, slots=True, eq=False)
class LaserScan(Observation):
    """One sweep, field for field ``sensor_msgs/LaserScan``.

    Attributes:
        angle_min: Angle of ``ranges[0]`` about the sensor's z axis (rad).
        angle_increment: Angle between neighbours (rad).
        range_min: Shorter returns are the robot itself (m).
        range_max: Longest range that counts (m).
        mount: The sensor's pose in ``base_link``.
        ranges: Shape (n,), float32 (m); ``inf`` where nothing came back.
    """

    angle_min: Radians
    angle_increment: Radians
    range_min: Metres
    range_max: MaxRange
    mount: Annotated[Pose2D, IN_MESSAGE]
    ranges: NDArray[np.float32]

    def returns(self) -> NDArray[np.bool_]:
        """Which ranges count: what came back from farther than the robot itself."""
        ranges = self.ranges
        return (
            np.isfinite(ranges)
            & (ranges >= self.range_min)
            & (ranges <= self.range_max)
        )

    def speaks(self) -> NDArray[np.bool_]:
        """Which beams say something: they ended in range, or found nothing in it."""
        return self.returns() | np.isposinf(self.ranges)

    def points(self, pose: Pose2D) -> NDArray[np.float32]:
        """Returns that count, in the frame that ``pose`` is in; shape (m, 2), (m)."""
        ranges, counts = self.ranges, self.returns()
        sensor = pose.compose(self.mount)
        angles = (
            sensor.yaw + self.angle_min + self.angle_increment * np.flatnonzero(counts)
        )
        hits = ranges[counts]
        out = np.empty((hits.size, 2), np.float32)
        out[:, 0] = sensor.x + hits * np.cos(angles)
        out[:, 1] = sensor.y + hits * np.sin(angles)
        return out


def _named(class_id: object) -> object:
    """Some detectors number their classes."""
    return str(class_id) if type(class_id) is int else class_id


def _has_sides(box: Box3D) -> Box3D:
    if box.xmin > box.xmax or box.ymin > box.ymax or box.zmin > box.zmax:
        raise ValueError("a side begins behind its end")
    return box


@dataclass(frozen=True, slots=True)
class Detection:
    """One box that a robot's detector reported.

    Attributes:
        class_id: As sent (``farmer``); the rule's class comes from the alias table.
        probability: 0 to 1.
        box: In ``frame_id``.
        frame_id: As sent (``iveg.domain.frames`` resolves it); None: without one.
    """

    class_id: Annotated[Text, BeforeValidator(_named)]
    probability: Share
    box: Annotated[Box3D, AfterValidator(_has_sides), Field(alias="position")]
    frame_id: FrameName | None = None
    det_id: Text | None = None


@dataclass(frozen=True, slots=True)
class DetectionFrame(Observation):
    """All detections of one picture; an empty frame means that nothing was seen.

    Attributes:
        unread: Class of each box that could not be used (no confidence, no position);
            None where that is not known either.
        detector: Name of the network, by which it is calibrated; None: not told.
    """

    detections: tuple[Detection, ...]
    unread: tuple[str | None, ...] = ()
    detector: Text | None = None


@dataclass(frozen=True, slots=True)
class Hold:
    """A reason why a robot may not move (docs/safety.md, "Holds")."""

    id: Text
    source: Literal["iveg", "boot", "hw", "bumper", "link"]
    ack: Literal["remote", "local", "auto"]


@dataclass(frozen=True, slots=True)
class RobotFault:
    """A fault of a robot's own data (docs/interfaces/mqtt.md).

    Attributes:
        code: A short, stable name, such as ``no_transform``.
        about: Which frames or topic.
        for_s: For how long (s); None where that is not known.
    """

    code: Text
    about: Text = ""
    for_s: Seconds | None = None


@dataclass(frozen=True, slots=True)
class Unplaced(Observation):
    """A measurement whose place in ``map`` is not known.

    Attributes:
        kind: What would have been sent.
        twist: Of odometry; a speed needs no place.
    """

    kind: Literal["odometry", "scan"]
    twist: Twist2D | None = None


@dataclass(frozen=True, slots=True)
class ReportedObstacle:
    """Something that a robot's laser sees near it and nothing explains.

    Attributes:
        x: Its middle in ``map`` (m); ``y`` likewise.
        width_m: From its first return to its last (m).
        moved: It walks, or has walked since the laser saw it first.
    """

    x: Annotated[Metres, digits(2)]
    y: Annotated[Metres, digits(2)]
    width_m: Annotated[float, Strict(), Field(ge=0, le=100), digits(2)]
    moved: Flag


def _is_true(value: object) -> bool:
    """A wish that cannot be read is none."""
    return value is True


Reason = Annotated[
    Text,
    one_of(
        "clear",
        "person",
        "robot",
        "stale",
        "doubt",
        "unsupervised",
        "hold",
        "watchdog",
        "obstacle",
    ),
]
Holds = Annotated[tuple[Hold, ...], Field(max_length=MAX_TEXT)]


@dataclass(frozen=True, slots=True)
class SafetyReport(Observation):
    """The speed factor that the robot applies and its reasons, as it reports them.

    Attributes:
        cause: Person, robot or hold that the factor is for.
        released: The last 64 hold ids that were released.
        challenge: Must be echoed by a release or resume.
        linear: Measured speed (m/s); ``angular`` (rad/s).
        feedback_age_s: How old the newest feedback is that the robot acts on (s).
        faults: What it finds wrong with its own data.
        peer_scans: It asks for scans of its peers.
        obstacle: What its laser sees near it, whatever it is slow for.
    """

    speed_factor: Annotated[float, Strict(), Field(ge=0, le=1)]
    reason: Reason
    cause: Text | None = None
    decision_id: Text | None = None
    holds: Holds = ()
    released: Annotated[tuple[Text, ...], Field(max_length=MAX_TEXT)] = ()
    challenge: Annotated[Text | None, Field(alias="ch")] = None
    linear: Annotated[Speed, Field(alias="v")] = 0.0
    angular: Annotated[Speed, Field(alias="w")] = 0.0
    feedback_age_s: Seconds | None = None
    faults: Annotated[tuple[RobotFault, ...], Field(max_length=MAX_TEXT), IF_ANY] = ()
    peer_scans: Annotated[bool, BeforeValidator(_is_true), IF_ANY] = False
    obstacle: Annotated[ReportedObstacle | None, OR_NONE, IF_ANY] = None


def _level(point: object) -> object:
    """A point of a path may have a height, which is left."""
    return point[:2] if isinstance(point, list) and len(point) == 3 else point


Millimetres = Annotated[Metres, digits(3)]
Waypoint = Annotated[tuple[Millimetres, Millimetres], BeforeValidator(_level)]


@dataclass(frozen=True, slots=True)
class Navigation(Observation):
    """A robot's intent: task, goal and path in ``map`` (m)."""

    task: Text
    goal: Annotated[tuple[Metres, Metres], *place("xy", 3)] | None = None
    path: Annotated[tuple[Waypoint, ...], Field(max_length=MAX_PATH)] = ()


@dataclass(frozen=True, slots=True)
class Battery(Observation):
    """The battery, as the robot said last."""

    percentage: Annotated[float | None, Quantity("0–1", "charge", 0, 1)] = None
    charging: Annotated[bool | None, Quantity("–", "whether it charges")] = None
    voltage: Annotated[float | None, Quantity("V", "voltage", 0, 1e4)] = None


@dataclass(frozen=True, slots=True)
class CommandStatus(Observation):
    """The IoT Agent's opinion of a command; displayed, never believed."""

    origin: Origin = field(default=UNKNOWN_ORIGIN, init=False)
    status: str


@dataclass(frozen=True, slots=True)
class CommandAnswer(Observation):
    """The robot's own answer on ``cmdexe`` (or ``cmd_info``).

    Attributes:
        attempt: Of the release or resume that is answered; None for a STOP.
    """

    id: Annotated[Text | None, Field(default=None)]
    result: Annotated[
        Text,
        one_of("LATCHED", "RELEASED", "RESUMED", "REFUSED"),
        Field(alias="r"),
    ]
    holds: Holds = ()
    challenge: Annotated[Text | None, Field(alias="ch")] = None
    linear: Annotated[Speed, Field(alias="v")] = 0.0
    why: Text | None = None
    attempt: Text | None = None


@dataclass(frozen=True, slots=True)
class GoalAnswer(Observation):
    """The robot's own word of a goal, on ``cmdexe`` (or ``goal_info``).

    Attributes:
        id: Of the goal.
        result: ``ACCEPTED``, ``REFUSED``, ``REACHED`` or ``DROPPED``.
        why: Code of the reason of a refusal, or for which it was dropped.
    """

    id: Text
    result: Annotated[
        Text,
        one_of("ACCEPTED", "REFUSED", "REACHED", "DROPPED"),
        Field(alias="r"),
    ]
    why: Text | None = None


@dataclass(frozen=True, slots=True)
class Climate(Observation):
    """Air in the greenhouse: °C, 0–1, ppm; None where a sensor is silent."""

    robot_id: str = field(default="", init=False)
    origin: Origin = field(default=UNKNOWN_ORIGIN, init=False)
    temperature: Annotated[float | None, Strict(), Field(ge=-60, le=90)] = None
    relative_humidity: Annotated[
        float | None, Strict(), Field(ge=0, le=1, alias="relativeHumidity")
    ] = None
    co2: Annotated[float | None, Strict(), Field(ge=0, le=100_000)] = None


@dataclass(frozen=True, slots=True)
class EntityReading:
    """Attributes of other equipment as Orion tells them, still unread.

    It is of no robot and waits in no queue of theirs (``pipeline.equipment``).
    """

    entity_id: str
    attributes: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class HeartbeatProbe(Observation):
    """iVeg's own heartbeat probe after its way through the whole data path."""

    robot_id: str = field(default="", init=False)


@dataclass(frozen=True, slots=True)
class RefusedFrame(Observation):
    """A detection frame that came and could not be read: somebody may be in it."""

    origin: Origin = field(default=UNKNOWN_ORIGIN, init=False)


def kind_of(observation: Observation) -> type[Observation]:
    """The stream of its robot that an observation belongs to."""
    if isinstance(observation, RefusedFrame):
        return DetectionFrame
    return type(observation)


@dataclass(frozen=True, slots=True)
class Received:
    """An observation with the moment and the transport that brought it.

    Attributes:
        asked: It is Orion's answer to a question, so nobody knows how old it is.
        sparse: Its topic has two safety reports a second; else ten while a robot holds.
        alone: It is the only one of its boot so far, and came through FIWARE: a broker
            may have kept it for an agent that has just started.
    """

    observation: Observation
    at: Instant
    transport: TransportId = FIWARE.id
    asked: bool = False
    sparse: bool = True
    alone: bool = False
