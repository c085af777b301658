"""Writing of the feedback that iVeg publishes for the fleet."""

import math
from collections.abc import Mapping
from functools import lru_cache
from operator import is_

import orjson

from iveg.domain.feedback import (
    CLEAR,
    LONGEST_BACKLOG_S,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import Twist2D
from iveg.domain.known import KnownPlace
from iveg.ngsi.codec.fields import rounded, without_none, write_origin


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
            **_write_known(feedback.known_here),
        }
    )


def _write_known(places: tuple[KnownPlace, ...]) -> dict[str, object]:
    if not places:
        return {}
    return {"known_here": [_write_place(one) for one in places]}


def _write_place(place: KnownPlace) -> dict[str, object]:
    return without_none(
        {
            "x": rounded(place.x),
            "y": rounded(place.y),
            "radius_m": place.radius_m,
            "most_out_m": None if math.isinf(place.most_out_m) else place.most_out_m,
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
