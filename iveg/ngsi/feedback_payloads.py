"""The shapes of what iVeg and peers send to robots, as strict as the others."""

from typing import Annotated, Literal

from pydantic import Field

from iveg.ngsi.payloads import (
    MAX_BOXES,
    MAX_ROBOTS,
    Metres,
    MotionFields,
    OriginFields,
    PointValue,
    Seconds,
    Speed,
    Text,
    Wire,
)


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
    known_here: object = None


class KnownPlaceValue(Wire):
    """A place where what stands still slows nobody, inside the feedback."""

    x: Metres
    y: Metres
    radius_m: Annotated[float, Field(gt=0, le=0.5)]
    most_out_m: Annotated[float, Field(ge=0, le=0.5)] | None = None
