"""The shapes on the wire, strict: no coercion, no NaN, all bounded."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from iveg.domain.backfill import MOST_MESSAGES
from iveg.ngsi.texts import MAX_TEXT, clean_text

MAX_BEAMS = 4096
MAX_RANGE_M = 1e6
MAX_BOXES = 256
MAX_ROBOTS = 256
MAX_PATH = 1024


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


class LidarHeaderValue(OriginFields):
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

    class_id: Text
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


class BackfillValue(OriginFields):
    """``/{robot}/iveg/backfill``; its messages are read one by one."""

    robot_id: Text
    messages: Annotated[list[dict[str, object]], Field(max_length=MOST_MESSAGES)]


class NotificationValue(Wire):
    """A notification of Orion; entities are read attribute by attribute."""

    subscriptionId: Text  # noqa: N815 - NGSI name
    data: Annotated[list[dict[str, object]], Field(max_length=1000)]
