"""Fields that several messages share: who said it and when, holds, round numbers."""

from collections.abc import Iterable, Mapping

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import FeedbackRef, Hold, LaserScan, Origin
from iveg.domain.stamps import parse_stamp
from iveg.ngsi import names, payloads


def read_origin(value: payloads.OriginFields) -> Origin:
    """Read boot, sequence number, time, and the newest feedback of the sender."""
    stamp_s = None if value.stamp is None else parse_stamp(value.stamp)
    heard = value.heard
    return Origin(
        value.boot,
        value.seq,
        value.stamp,
        stamp_s,
        value.mono,
        # A robot without feedback yet sends ``null``.
        acknowledgements="heard" in value.model_fields_set,
        heard=None if heard is None else FeedbackRef(heard.boot, heard.seq),
        replay=value.replay,
    )


_PROOF = ("mono", "heard", "replay")


def read_stamped(attributes: Mapping[str, object]) -> Origin:
    """The message's own stamp, and what proves its age, which stands at the pose."""
    pose = attributes.get("pose")
    if not isinstance(pose, dict):
        pose = {}
    fields = {key: pose[key] for key in _PROOF if key in pose}
    fields["stamp"] = attributes.get("timestamp")
    return read_origin(payloads.OriginFields.model_validate(fields))


def refuse_unplaced(value: object) -> None:
    """Refuse data without a position: it is counted and never drawn."""
    if isinstance(value, dict) and value.get("frame_id") == names.UNPLACED:
        raise UnreadableError(names.UNPLACED, "the robot knows no place for it")


def write_origin(origin: Origin) -> dict[str, object]:
    """The inverse of :func:`read_origin`."""
    fields: dict[str, object] = {
        "boot": origin.boot,
        "seq": origin.seq,
        "stamp": origin.stamp,
    }
    if origin.mono is not None:
        fields["mono"] = round(origin.mono, 6)
    if origin.acknowledgements:
        heard = origin.heard
        fields["heard"] = (
            None if heard is None else {"boot": heard.boot, "seq": heard.seq}
        )
    if origin.replay is not None:
        fields["replay"] = origin.replay
    return fields


def read_holds(values: Iterable[payloads.HoldValue]) -> tuple[Hold, ...]:
    """Why a robot may not move."""
    return tuple(Hold(value.id, value.source, value.ack) for value in values)


def write_hold(hold: Hold) -> dict[str, str]:
    """One hold of a robot's report."""
    return {"id": hold.id, "source": hold.source, "ack": hold.ack}


def write_motion(pose: Pose2D, twist: Twist2D) -> dict[str, object]:
    """Pose and twist of an odometry."""
    return {
        "x": round(pose.x, 4),
        "y": round(pose.y, 4),
        "yaw": round(pose.yaw, 5),
        "linear_velocity": round(twist.linear_x, 4),
        "angular_velocity": round(twist.angular_z, 4),
    }


def write_lidar_header(scan: LaserScan, origin: dict[str, object]) -> dict[str, object]:
    """``lidar_header``, with the origin of its message."""
    return {
        "angle_min": scan.angle_min,
        "angle_increment": scan.angle_increment,
        "range_min": scan.range_min,
        "range_max": scan.range_max,
        "x": scan.mount.x,
        "y": scan.mount.y,
        "yaw": scan.mount.yaw,
        **origin,
    }


def rounded(value: float | None) -> float | None:
    """To a tenth of a millimetre, or of a thousandth."""
    return None if value is None else round(value, 4)


def without_none(fields: dict[str, object]) -> dict[str, object]:
    """Only what is known: absent, never ``null``."""
    return {name: value for name, value in fields.items() if value is not None}
