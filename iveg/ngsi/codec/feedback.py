"""Reading of the feedback that iVeg publishes for the fleet.

Writing of the feedback that iVeg publishes for the fleet.
"""

from collections.abc import Mapping
from functools import lru_cache
from operator import is_

import orjson
from pydantic import ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.feedback import (
    CLEAR,
    LONGEST_BACKLOG_S,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.parameters import CLASSES, ROBOTS_HEAR, Class, Parameter, Sent
from iveg.ngsi import payloads
from iveg.ngsi.codec.fields import (
    first_complaint,
    load_json,
    read_origin,
    rounded,
    without_none,
    write_origin,
)


def read_feedback(payload: bytes) -> Feedback:
    """Read ``/{robot}/mqtt_feedback``.

    Raises:
        UnreadableError: not a feedback; counts as no feedback (docs/safety.md).
    """
    try:
        value = payloads.FeedbackValue.model_validate(load_json(payload))
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
        _rule(value.rule),
    )


def _speed_limits(value: payloads.FeedbackValue) -> dict[str, SpeedLimit]:
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


def _rule(value: object) -> Sent:
    """Values of the rule; what cannot be read is left out and never costs the rest."""
    told = value if isinstance(value, dict) else {}
    return {
        row.name: read
        for row in ROBOTS_HEAR
        if (read := _of_classes(row, told.get(row.name)))
    }


def _of_classes(row: Parameter, value: object) -> Mapping[Class, float]:
    told = value if isinstance(value, dict) else {}
    return {
        class_: float(one)
        for class_ in CLASSES
        if isinstance(one := told.get(class_), int | float)
        and not isinstance(one, bool)
        and row.least <= one <= row.most
    }


def _alert(value: payloads.AlertValue) -> FeedbackAlert:
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


class FeedbackWriter:
    """Writes feedback; what the messages of one telling share is written once."""

    def __init__(self) -> None:
        self._shared: tuple[object, ...] = (None, None, None)
        self._written: dict[str, orjson.Fragment] = {}

    def write(self, feedback: Feedback) -> bytes:
        """The bytes of ``/{robot}/mqtt_feedback``."""
        shared = feedback.alerts, feedback.speed_limits, feedback.seen
        if not all(map(is_, shared, self._shared)):
            self._shared = shared
            self._written = {
                name: orjson.Fragment(orjson.dumps(value))
                for name, value in _write_shared(feedback).items()
            }
        return _write(feedback, self._written)


def write_feedback(feedback: Feedback) -> bytes:
    """The bytes of ``/{robot}/mqtt_feedback``."""
    return _write(feedback, _write_shared(feedback))


def _write(feedback: Feedback, shared: Mapping[str, object]) -> bytes:
    alert = feedback.alert
    return orjson.dumps(
        {
            **write_origin(feedback.origin),
            "robot_id": feedback.robot_id,
            "alert": None if alert is None else _write_alert(alert),
            "robot_pose": _write_feedback_pose(feedback),
            **shared,
            **_write_backlog(feedback.backlog_s),
            **({"foresight": True} if feedback.foresight else {}),
            **({"rule": feedback.rule} if feedback.rule else {}),
        }
    )


def _write_backlog(backlog_s: float | None) -> dict[str, object]:
    if backlog_s is None:
        return {}
    return {"backlog": {"fiware_s": round(min(backlog_s, LONGEST_BACKLOG_S), 1)}}


def _write_shared(feedback: Feedback) -> dict[str, object]:
    """Part of the feedback that is the same for all robots.

    Of a robot that is clear the id alone is written, or the fleet's limits would be
    most of the message; a robot that is named nowhere is unsupervised.
    """
    return {
        "alerts": [_write_alert(alert) for alert in feedback.alerts],
        "speed_limits": {
            robot_id: _write_speed_limit(speed_limit)
            for robot_id, speed_limit in feedback.speed_limits.items()
            if speed_limit != CLEAR
        },
        "clear": [
            robot_id
            for robot_id, speed_limit in feedback.speed_limits.items()
            if speed_limit == CLEAR
        ],
        "seen": dict(feedback.seen),
    }


def _write_speed_limit(speed_limit: SpeedLimit) -> dict[str, object]:
    return without_none(
        {
            "speed_factor": speed_limit.speed_factor,
            "reason": speed_limit.reason,
            "cause": speed_limit.cause,
            "distance_m": rounded(speed_limit.distance_m),
            "decision_id": speed_limit.decision_id,
            "foretold_s": rounded(speed_limit.foretold_s),
            "over": speed_limit.over or None,
        }
    )


def _write_alert(alert: FeedbackAlert) -> dict[str, object]:
    return without_none(
        {
            "decision_id": alert.decision_id or None,
            "class": alert.class_,
            "class_id": alert.class_id,
            "conf": rounded(alert.confidence),
            "position": _write_vector("xyz", alert.position),
            "radius_m": rounded(alert.radius_m),
            "stamp": alert.stamp,
            "observer": alert.observer,
            "velocity": _write_vector("xy", alert.velocity),
        }
    )


@lru_cache(maxsize=512)
def _write_vector(
    axes: str, vector: tuple[float, ...] | None
) -> orjson.Fragment | None:
    """Of a ring it stays the same for as long as nobody looks there anew."""
    if vector is None:
        return None
    return orjson.Fragment(
        orjson.dumps(dict(zip(axes, map(rounded, vector), strict=True)))
    )


def _write_feedback_pose(feedback: Feedback) -> dict[str, object] | None:
    if feedback.pose is None:
        return None
    twist = feedback.twist or Twist2D(0.0, 0.0)
    return {
        "x": feedback.pose.x,
        "y": feedback.pose.y,
        "yaw": feedback.pose.yaw,
        "linear_velocity": twist.linear_x,
        "angular_velocity": twist.angular_z,
        "stamp": feedback.pose_stamp,
    }
