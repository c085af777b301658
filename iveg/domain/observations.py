"""Observations: frozen values, each with its robot, its order and its age.

An observation is the only declaration of its message: names on the wire, bounds and
digits stand at its members.  Names are those of ``nav_msgs``, ``sensor_msgs`` and the
NGSI entity.  Times are Unix seconds unless said otherwise.
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
    known_text,
    place,
)

MOST_HEARD_ALSO = 3
"""Bound of ``heard_also``: a robot follows four authors, ours included."""


@dataclass(frozen=True, slots=True)
class Instant:
    """One moment on both clocks of iVeg.

    Attributes:
        mono: Monotonic seconds, for deadlines and ages.
        wall: Unix seconds, for people, logs and storage.
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
        boot: Random id, new at every start of the robot; None: not sent.
        seq: Count of the messages of a topic; None: not sent.
        stamp: The robot's clock, exactly as sent; for display and clock offset only.
        stamp_s: The same as Unix seconds; None: missing or unreadable.
        mono: The robot's monotonic seconds since this boot, one axis for all topics.
        acknowledgements: Whether the sender echoes feedback, so that its age can be
            proven.
        heard: The newest feedback that it had received; None before the first.
        heard_also: The newest feedback of every other author that it receives.
        replay: Map frame of a recording that is played; only recordings of one frame
            see each other.  None: the sender is a live robot.
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
        """The newest feedback of each author that the sender had received."""
        return () if self.heard is None else (self.heard, *self.heard_also)

    @property
    def own_s(self) -> float | None:
        """Time on the robot's own clock (s): monotonic if sent, else the stamp.

        Comparable among the topics of one boot only.
        """
        return self.stamp_s if self.mono is None else self.mono


UNKNOWN_ORIGIN = Origin()
"""Origin of an observation that is not counted, or not yet."""


@dataclass(frozen=True, slots=True)
class Observation:
    """Something that a robot or a device observed.

    Attributes:
        robot_id: The robot that sent it; empty: no robot did.
        origin: Identity of the message.
    """

    __pydantic_config__ = ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False)

    robot_id: str
    origin: Origin


def _or_none(text: str | None) -> str | None:
    return text or None


FrameName = Annotated[Text, AfterValidator(_or_none)]
"""Name of a frame as sent; an empty name is none."""


@dataclass(frozen=True, slots=True)
class Odometry(Observation):
    """Pose of ``base_link`` in ``map`` and the twist in ``base_link``.

    Attributes:
        pose: Pose of ``base_link`` in ``map`` (m, rad).
        twist: Twist in ``base_link`` (m/s, rad/s).
        frame_id: Frame of the pose as sent; None: none was sent, which means ``map``.
    """

    pose: Annotated[Pose2D, IN_MESSAGE]
    twist: Annotated[Twist2D, IN_MESSAGE]
    frame_id: Annotated[FrameName | None, IF_ANY] = None


# Without equality, since arrays compare element by element.
@dataclass(frozen=True, slots=True, eq=False)
class LaserScan(Observation):
    """One sweep, with the fields of ``sensor_msgs/LaserScan``.

    Attributes:
        angle_min: Angle of ``ranges[0]`` about the sensor's z axis (rad).
        angle_increment: Angle between neighbours (rad).
        range_min: Bound below which returns are of the robot itself (m).
        range_max: Longest range that counts (m).
        mount: The sensor's pose in ``base_link``.
        ranges: Shape (n,), float32 (m); ``inf``: nothing came back.
    """

    angle_min: Radians
    angle_increment: Radians
    range_min: Metres
    range_max: MaxRange
    mount: Annotated[Pose2D, IN_MESSAGE]
    ranges: NDArray[np.float32]

    def returns(self) -> NDArray[np.bool_]:
        """Mask of the ranges that count: in range, and not of the robot itself."""
        ranges = self.ranges
        return (
            np.isfinite(ranges)
            & (ranges >= self.range_min)
            & (ranges <= self.range_max)
        )

    def speaks(self) -> NDArray[np.bool_]:
        """Mask of the beams that say something: a return, or nothing in range."""
        return self.returns() | np.isposinf(self.ranges)

    def points(self, pose: Pose2D) -> NDArray[np.float32]:
        """Returns that count, in the frame of ``pose``; shape (m, 2), (m)."""
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
    """The class as text, since some detectors number their classes."""
    return str(class_id) if type(class_id) is int else class_id


def _has_sides(box: Box3D) -> Box3D:
    if box.xmin > box.xmax or box.ymin > box.ymax or box.zmin > box.zmax:
        raise ValueError("a side begins behind its end")
    return box


@dataclass(frozen=True, slots=True)
class Detection:
    """One box that a robot's detector reported.

    Attributes:
        class_id: Class as sent (``farmer``); the alias table gives the rule's class.
        probability: Confidence, 0 to 1.
        box: Box in ``frame_id`` (m).
        frame_id: Frame as sent (``iveg.domain.frames`` resolves it); None: not sent.
        det_id: Id that the detector gave it; None: not sent.
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
        detections: The boxes that could be used.
        unread: Class of each box that could not be used (no confidence, no position);
            None in it: not even the class is known.
        detector: Name of the network; None: not sent.
    """

    detections: tuple[Detection, ...]
    unread: tuple[str | None, ...] = ()
    detector: Text | None = None

    @property
    def detector_name(self) -> str:
        """Name by which its words are known: the robot's where it has none."""
        return self.detector or self.robot_id


@dataclass(frozen=True, slots=True)
class Hold:
    """A reason why a robot may not move (docs/safety.md, "Holds").

    Attributes:
        id: Its id, never used again.
        source: Cause of the hold.
        ack: Side that may lift it: iVeg, somebody at the robot, or the robot itself.
    """

    id: Text
    source: Literal["iveg", "boot", "hw", "bumper", "link"]
    ack: Literal["remote", "local", "auto"]


@dataclass(frozen=True, slots=True)
class RobotFault:
    """A fault of a robot's own data (docs/interfaces/mqtt.md).

    Attributes:
        code: A short, stable name, such as ``no_transform``.
        about: The frames or the topic.
        for_s: Duration (s); None: unknown.
    """

    code: Text
    about: Text = ""
    for_s: Seconds | None = None


@dataclass(frozen=True, slots=True)
class Unplaced(Observation):
    """A measurement whose place in ``map`` is not known.

    Attributes:
        kind: Kind of the observation that it would have been.
        twist: Twist of odometry, since a speed needs no place.
    """

    kind: Literal["odometry", "scan"]
    twist: Twist2D | None = None


@dataclass(frozen=True, slots=True)
class ReportedObstacle:
    """An obstacle near a robot that its laser sees and nothing explains.

    Attributes:
        x: Its middle in ``map`` (m); ``y`` likewise.
        width_m: Distance from its first return to its last (m).
        moved: Whether it has walked since the laser saw it first.
    """

    x: Annotated[Metres, digits(2)]
    y: Annotated[Metres, digits(2)]
    width_m: Annotated[float, Strict(), Field(ge=0, le=100), digits(2)]
    moved: Flag


def _is_true(value: object) -> bool:
    """Whether a value is exactly true; an unreadable value is false."""
    return value is True


Reason = Annotated[
    Text,
    known_text(
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
        speed_factor: Factor from 0 to 1.
        reason: Reason of the factor.
        cause: Person, robot or hold that is the cause.
        decision_id: Decision of iVeg that the factor follows; None: it follows none.
        holds: All present holds.
        released: Ids of the last 64 holds that were released.
        challenge: Random text that a release or resume must echo.
        linear: Measured speed (m/s).
        angular: Measured turn rate (rad/s).
        feedback_age_s: Age of the newest feedback that the robot acts on (s).
        faults: Faults of its own data.
        peer_scans: Whether it wants scans of its peers.
        obstacle: The obstacle that its laser sees, whatever the reason is.
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
    """A point of a path without its height."""
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
    """Battery of a robot, by its newest message."""

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
        id: The hold, for a STOP; None: not sent.
        result: ``LATCHED``, ``RELEASED``, ``RESUMED`` or ``REFUSED``.
        holds: All holds after the order.
        challenge: The challenge after the order.
        linear: Measured speed (m/s).
        why: Reason of a refusal.
        attempt: Id of the release or resume that is answered; None: it was a STOP.
    """

    id: Annotated[Text | None, Field(default=None)]
    result: Annotated[
        Text,
        known_text("LATCHED", "RELEASED", "RESUMED", "REFUSED"),
        Field(alias="r"),
    ]
    holds: Holds = ()
    challenge: Annotated[Text | None, Field(alias="ch")] = None
    linear: Annotated[Speed, Field(alias="v")] = 0.0
    why: Text | None = None
    attempt: Text | None = None


@dataclass(frozen=True, slots=True)
class GoalAnswer(Observation):
    """The robot's own answer about a goal, on ``cmdexe`` (or ``goal_info``).

    Attributes:
        id: Id of the goal.
        result: ``ACCEPTED``, ``REFUSED``, ``REACHED`` or ``DROPPED``.
        why: Code of the reason why it was refused or dropped.
    """

    id: Text
    result: Annotated[
        Text,
        known_text("ACCEPTED", "REFUSED", "REACHED", "DROPPED"),
        Field(alias="r"),
    ]
    why: Text | None = None


@dataclass(frozen=True, slots=True)
class Climate(Observation):
    """Air in the greenhouse: temperature (°C), humidity (0–1), CO₂ (ppm).

    A value is None while its sensor is silent.
    """

    robot_id: str = field(default="", init=False)
    origin: Origin = field(default=UNKNOWN_ORIGIN, init=False)
    temperature: Annotated[float | None, Strict(), Field(ge=-60, le=90)] = None
    relative_humidity: Annotated[
        float | None, Strict(), Field(ge=0, le=1, alias="relativeHumidity")
    ] = None
    co2: Annotated[float | None, Strict(), Field(ge=0, le=100_000)] = None


@dataclass(frozen=True, slots=True)
class EntityReading:
    """Attributes of other equipment as Orion sends them, still unread.

    It belongs to no robot and waits in no robot's queue (``comfort.equipment``).
    """

    entity_id: str
    attributes: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class HeartbeatProbe(Observation):
    """iVeg's own heartbeat probe, back from the whole data path."""

    robot_id: str = field(default="", init=False)


@dataclass(frozen=True, slots=True)
class RefusedFrame(Observation):
    """A detection frame that could not be read: somebody may be in it."""

    origin: Origin = field(default=UNKNOWN_ORIGIN, init=False)


@dataclass(frozen=True, slots=True)
class Copy(Observation):
    """Another copy of a message that was taken already; only its arrival counts.

    Attributes:
        kind: Kind of the message.
    """

    kind: type[Observation]


def kind_of(observation: Observation) -> type[Observation]:
    """Kind of the stream that an observation belongs to."""
    if isinstance(observation, Copy):
        return observation.kind
    if isinstance(observation, RefusedFrame):
        return DetectionFrame
    return type(observation)


@dataclass(frozen=True, slots=True)
class Received:
    """An observation with the moment and the transport that brought it.

    Attributes:
        observation: The observation.
        at: Time of arrival.
        transport: The transport that brought it.
        is_query_answer: Whether Orion answered a query with it: its age is unknown.
        sparse: Whether its topic has two safety reports a second, not ten.
        alone: Whether it came through FIWARE and is the first of its boot: a broker may
            have retained it for an agent that has just started.
    """

    observation: Observation
    at: Instant
    transport: TransportId = FIWARE.id
    is_query_answer: bool = False
    sparse: bool = True
    alone: bool = False
