"""Reading of the feedback that iVeg publishes for the fleet."""

import math
from typing import Annotated

from pydantic import Field, TypeAdapter, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.feedback import (
    CLEAR,
    LONGEST_BACKLOG_S,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.known import MOST_TOLD, KnownPlace
from iveg.ngsi import feedback_payloads
from iveg.ngsi.codec.fields import read_origin
from iveg.ngsi.codec.untrusted import first_complaint, load_json

_PLACES: TypeAdapter[list[feedback_payloads.KnownPlaceValue]] = TypeAdapter(
    Annotated[list[feedback_payloads.KnownPlaceValue], Field(max_length=MOST_TOLD)]
)


def read_feedback(payload: bytes) -> Feedback:
    """Read ``/{robot}/mqtt_feedback``.

    Raises:
        UnreadableError: not a feedback; counts as no feedback (docs/safety.md).
    """
    try:
        value = feedback_payloads.FeedbackValue.model_validate(load_json(payload))
    except ValidationError as error:
        raise UnreadableError("not_feedback", first_complaint(error)) from error
    pose = value.robot_pose
    return Feedback(
        value.robot_id,
        read_origin(value),
        None if value.alert is None else _alert(value.alert),
        tuple(_alert(alert) for alert in value.alerts),
        None if pose is None else Pose2D(pose.x, pose.y, pose.yaw),
        None if pose is None else Twist2D(pose.linear_velocity, pose.angular_velocity),
        None if pose is None else pose.stamp,
        _speed_limits(value),
        value.seen,
        _backlog(value.backlog),
        value.foresight,
        _known_here(value.known_here),
    )


def _speed_limits(value: feedback_payloads.FeedbackValue) -> dict[str, SpeedLimit]:
    """Of every robot that is named."""
    return dict.fromkeys(value.clear, CLEAR) | {
        robot_id: SpeedLimit(
            one.speed_factor,
            one.reason,
            one.cause,
            one.distance_m,
            one.decision_id,
            one.foretold_s,
            one.over,
        )
        for robot_id, one in value.speed_limits.items()
    }


def _backlog(value: object) -> float | None:
    """Seconds; what cannot be read is no news, and never costs the rest."""
    seconds = value.get("fiware_s") if isinstance(value, dict) else None
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or seconds < 0:
        return None
    return min(float(seconds), LONGEST_BACKLOG_S)


def _known_here(value: object) -> tuple[KnownPlace, ...]:
    """Known places; what cannot be read is none, and never costs the rest."""
    try:
        places = _PLACES.validate_python(value or [])
    except ValidationError:
        return ()
    return tuple(
        KnownPlace(
            one.x,
            one.y,
            one.radius_m,
            math.inf if one.most_out_m is None else one.most_out_m,
        )
        for one in places
    )


def _alert(value: feedback_payloads.AlertValue) -> FeedbackAlert:
    position, goes = value.position, value.velocity
    return FeedbackAlert(
        value.decision_id or "",
        value.stamp or "",
        value.class_,
        value.class_id,
        value.conf,
        None if position is None else (position.x, position.y, position.z),
        value.radius_m,
        value.observer,
        None if goes is None else (goes.x, goes.y),
    )
