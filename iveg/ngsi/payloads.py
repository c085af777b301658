"""The shapes on the wire, strict: no coercion, no NaN, all bounded.

Texts from the wire: which are safe to keep and to show.

The shapes of what iVeg and peers send to robots, as strict as the others.

The shapes of what peers' lasers saw, as robots are sent it.
"""

import unicodedata
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from iveg.domain.peer_scan import BEAMS, PLACES

MAX_TEXT = 64


FORBIDDEN = frozenset("<>\"'=;()")
"""Characters that Orion refuses, with the whole update they stand in."""


def clean_text(text: str) -> str:
    """Text that is safe to keep and show: NFC, no control or format marks, short."""
    if text.isascii() and text.isprintable():
        # Nearly all is plain, and plain text needs no look at each character.
        return text[:MAX_TEXT]
    kept = "".join(
        c
        for c in unicodedata.normalize("NFC", text[: 4 * MAX_TEXT])
        if unicodedata.category(c)[0] != "C"
    )
    return kept[:MAX_TEXT]


def legible(text: str) -> str:
    """Text without characters that are unseen or turn others round (Cc, Cf, Cs …).

    Line ends stay.
    """
    return "".join(c for c in text if c == "\n" or unicodedata.category(c)[0] != "C")


def all_legible(value: object) -> object:
    """JSON with every text in it legible."""
    match value:
        case str():
            return legible(value)
        case list():
            return [all_legible(one) for one in value]
        case dict():
            return {legible(name): all_legible(one) for name, one in value.items()}
    return value


MAX_BEAMS = 4096
MAX_RANGE_M = 1e6
MAX_BOXES = 256
MAX_ROBOTS = 256
MAX_PATH = 1024
MOST_HEARD_ALSO = 3


Text = Annotated[str, AfterValidator(clean_text)]
Metres = Annotated[float, Field(ge=-1e6, le=1e6)]
Radians = Annotated[float, Field(ge=-1e4, le=1e4)]
Speed = Annotated[float, Field(ge=-100, le=100)]
"""Beyond any machine; what a robot of its profile cannot have is doubt."""
Seconds = Annotated[float, Field(ge=0, le=1e9)]
"""Up to thirty years."""


class Wire(BaseModel):
    """Base of everything that comes over the wire."""

    model_config = ConfigDict(
        strict=True, extra="ignore", allow_inf_nan=False, frozen=True
    )


Count = Annotated[int, Field(ge=0, le=2**53)]


class FeedbackRefValue(Wire):
    """The newest feedback of iVeg that a robot has received."""

    boot: Text
    seq: Count


class OriginFields(Wire):
    """Identity and order that each robot message carries; ``heard`` may be ``null``."""

    boot: Text | None = None
    seq: Count | None = None
    stamp: Text | None = None
    mono: Seconds | None = None
    heard: FeedbackRefValue | None = None
    heard_also: list[FeedbackRefValue] = Field([], max_length=MOST_HEARD_ALSO)
    replay: Text | None = None


class BoxesHeaderValue(OriginFields):
    """``detection_header``."""

    detector: Text | None = None


class MotionFields(Wire):
    """Pose in ``map`` and twist."""

    x: Metres
    y: Metres
    yaw: Radians
    linear_velocity: Speed = 0.0
    angular_velocity: Speed = 0.0


class OdometryValue(MotionFields, OriginFields):
    """``base_pose_ground_truth``; Algorithm 1's ``pose`` has the same fields."""

    frame_id: Text | None = None


class ScanLabelValue(OriginFields):
    """Identity and frame of ``lidar_header``."""

    frame_id: Text | None = None


class LidarHeaderValue(ScanLabelValue):
    """``lidar_header``."""

    angle_min: Radians
    angle_increment: Radians
    range_min: Metres = 0.0
    range_max: Annotated[float, Field(gt=0, le=1e4)]
    x: Metres = 0.0
    y: Metres = 0.0
    yaw: Radians = 0.0


LidarPoints = Annotated[
    list[Annotated[float, Field(ge=0, le=MAX_RANGE_M, allow_inf_nan=False)] | None],
    Field(max_length=MAX_BEAMS),
]


class PositionValue(Wire):
    """A 3D box (m)."""

    xmin: Metres
    xmax: Metres
    ymin: Metres
    ymax: Metres
    zmin: Metres
    zmax: Metres

    @model_validator(mode="after")
    def _has_sides(self) -> Self:
        if self.xmin > self.xmax or self.ymin > self.ymax or self.zmin > self.zmax:
            raise ValueError("a side begins behind its end")
        return self


class BoxValue(Wire):
    """One element of ``bounding_boxes``."""

    class_id: Text | int
    probability: Annotated[float, Field(ge=0, le=1)]
    position: PositionValue
    frame_id: Text | None = None
    det_id: Text | None = None


class HoldValue(Wire):
    """One element of ``holds``."""

    id: Text
    source: Literal["iveg", "boot", "hw", "bumper", "link"]
    ack: Literal["remote", "local", "auto"]


class FaultValue(Wire):
    """One element of ``faults``."""

    code: Text
    about: Text = ""
    for_s: Seconds | None = None


class ObstacleValue(Wire):
    """``obstacle``, in ``map`` (m)."""

    x: Metres
    y: Metres
    width_m: Annotated[float, Field(ge=0, le=100)]
    moved: bool


class SafetyValue(OriginFields):
    """``safety_state``."""

    speed_factor: Annotated[float, Field(ge=0, le=1)]
    reason: Literal[
        "clear",
        "person",
        "robot",
        "stale",
        "doubt",
        "unsupervised",
        "hold",
        "watchdog",
        "obstacle",
    ]
    cause: Text | None = None
    decision_id: Text | None = None
    holds: Annotated[list[HoldValue], Field(max_length=MAX_TEXT)] = []
    released: Annotated[list[Text], Field(max_length=MAX_TEXT)] = []
    ch: Text | None = None
    v: Speed = 0.0
    w: Speed = 0.0
    feedback_age_s: Seconds | None = None
    faults: Annotated[list[FaultValue], Field(max_length=MAX_TEXT)] = []
    peer_scans: object = None
    obstacle: object = None


class PointValue(Wire):
    """A place in ``map`` (m)."""

    x: Metres
    y: Metres
    z: Metres = 0.0


class NavigationValue(OriginFields):
    """``navigation``."""

    task: Text
    goal: PointValue | None = None
    path: Annotated[
        list[Annotated[list[Metres], Field(min_length=2, max_length=3)]],
        Field(max_length=MAX_PATH),
    ] = []


class AnswerValue(OriginFields):
    """Answer of a robot on ``cmdexe``."""

    id: Text | None = None
    r: Literal["LATCHED", "RELEASED", "RESUMED", "REFUSED"]
    holds: Annotated[list[HoldValue], Field(max_length=MAX_TEXT)] = []
    ch: Text | None = None
    v: Speed = 0.0
    why: Text | None = None
    attempt: Text | None = None


class GoalAnswerValue(OriginFields):
    """A robot's word of a goal on ``cmdexe``."""

    id: Text
    r: Literal["ACCEPTED", "REFUSED", "REACHED", "DROPPED"]
    why: Text | None = None


class ClimateValue(Wire):
    """The climate device's message."""

    temperature: Annotated[float, Field(ge=-60, le=90)] | None = None
    relativeHumidity: Annotated[float, Field(ge=0, le=1)] | None = None  # noqa: N815 - NGSI name
    co2: Annotated[float, Field(ge=0, le=100_000)] | None = None


class NotificationValue(Wire):
    """A notification of Orion; entities are read attribute by attribute."""

    subscriptionId: Text  # noqa: N815 - NGSI name
    data: Annotated[list[dict[str, object]], Field(max_length=1000)]


class VelocityValue(Wire):
    """In ``map`` (m/s)."""

    x: Speed
    y: Speed


class AlertValue(Wire):
    """One alert inside the feedback."""

    decision_id: Text | None = None
    class_: Literal["person", "robot"] | None = Field(default=None, alias="class")
    class_id: Text | None = None
    conf: Annotated[float, Field(ge=0, le=1)] | None = None
    position: PointValue | None = None
    radius_m: Annotated[float, Field(gt=0, le=100)] | None = None
    stamp: Text | None = None
    observer: Text | None = None
    velocity: VelocityValue | None = None


class SpeedLimitValue(Wire):
    """One speed limit inside the feedback."""

    speed_factor: Annotated[float, Field(ge=0, le=1)]
    reason: Text = "clear"
    cause: Text | None = None
    distance_m: Annotated[float, Field(ge=0, le=1e7)] | None = None
    decision_id: Text | None = None
    foretold_s: Seconds | None = None
    over: bool = False


SpeedLimitsValue = Annotated[dict[str, SpeedLimitValue], Field(max_length=MAX_ROBOTS)]


class FeedbackPose(MotionFields):
    """Pose of the observer as iVeg knows it."""

    stamp: Text | None = None


class FeedbackValue(OriginFields):
    """``/{robot}/mqtt_feedback``."""

    robot_id: Text
    alert: AlertValue | None = None
    alerts: list[AlertValue] = Field([], max_length=MAX_BOXES)
    robot_pose: FeedbackPose | None = None
    speed_limits: SpeedLimitsValue = Field({})
    clear: list[Text] = Field([], max_length=MAX_ROBOTS)
    seen: dict[str, int] = Field({}, max_length=MAX_ROBOTS)
    backlog: object = None
    foresight: bool = False
    rule: object = None


class MountValue(Wire):
    """A laser in ``base_link`` (m, rad): no robot is longer than twice this."""

    x: Annotated[float, Field(ge=-5, le=5)]
    y: Annotated[float, Field(ge=-5, le=5)]
    yaw: Radians


class PeerPoseValue(Wire):
    """Where a peer's ``base_link`` was (m, rad)."""

    x: Metres
    y: Metres
    yaw: Radians
    frame_id: Literal["map"]


class PeerScanValue(OriginFields):
    """``/{robot}/iveg/peer_scan``."""

    robot_id: Text
    robot_pose: PeerPoseValue
    age_s: Annotated[float, Field(ge=0, le=2)]
    mount: MountValue
    range_max: Annotated[float, Field(gt=0, le=1e4)]
    ranges: Annotated[
        list[Annotated[float, Field(ge=0, le=1e4)] | None],
        Field(min_length=BEAMS, max_length=BEAMS),
    ]
    places: Annotated[
        list[Annotated[int, Field(ge=0, lt=PLACES)]],
        Field(min_length=BEAMS, max_length=BEAMS),
    ]
