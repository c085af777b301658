"""Data for tests: everything has a default, override what matters."""

from collections.abc import Iterable, Mapping

import numpy as np
import orjson

from iveg.adapters.fleet_files import built_in, load_fleet
from iveg.domain.fleet import FleetDescription
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    Hold,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Origin,
    Received,
    SafetyReport,
)
from iveg.domain.transports import FIWARE, TransportId
from iveg.ngsi.codec import format_stamp

AGI = built_in().of_robot("AGI").profile
AGII = built_in().of_robot("AGII").profile

START = Instant(mono=1000.0, wall=1_700_000_000.0)
"""When tests begin, on both clocks (s)."""


def at(seconds: float) -> Instant:
    """The moment this long after ``START``."""
    return START.later(seconds)


def fleet_of(*words: str) -> FleetDescription:
    """Robots as ``IVEG_ROBOTS`` names them; iVeg describes AGI and AGII itself."""
    return load_fleet(words=words)


def origin(
    seq: int = 1, *, boot: str = "boot-a", wall: float = START.wall, after: float = 0.0
) -> Origin:
    """Who counts a message; ``after`` (s) moves its stamp on from ``wall``."""
    return Origin(boot, seq, format_stamp(wall + after), wall + after)


def odometry(
    robot_id: str = "AGI",
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    *,
    linear: float = 0.5,
    angular: float = 0.0,
    origin: Origin = origin(),  # noqa: B008 - a frozen value
) -> Odometry:
    return Odometry(robot_id, origin, Pose2D(x, y, yaw), Twist2D(linear, angular))


def scan(
    robot_id: str = "AGI",
    ranges: Iterable[float] = (1.0, 2.0, float("inf"), 4.0),
    *,
    angle_min: float = 0.0,
    angle_increment: float = np.pi / 2,
    range_min: float = 0.1,
    range_max: float = 25.0,
    mount: Pose2D = Pose2D(0.0, 0.0, 0.0),
    origin: Origin = origin(),  # noqa: B008 - a frozen value
) -> LaserScan:
    return LaserScan(
        robot_id,
        origin,
        angle_min,
        angle_increment,
        range_min,
        range_max,
        mount,
        np.array(list(ranges), np.float32),
    )


def detection(
    class_id: str = "person",
    x: float = 0.0,
    y: float = 0.0,
    *,
    probability: float = 0.94,
    size: float = 0.5,
    height: float = 1.8,
    det_id: str | None = None,
) -> Detection:
    """A box in ``map``, centred on (x, y), standing on the floor."""
    half = size / 2
    box = Box3D(x - half, x + half, y - half, y + half, 0.0, height)
    return Detection(class_id, probability, box, "map", det_id)


def detection_frame(
    robot_id: str = "AGI",
    *detections: Detection,
    unreadable: int = 0,
    origin: Origin = origin(),  # noqa: B008 - a frozen value
) -> DetectionFrame:
    """One look; without detections: looked, saw nothing."""
    return DetectionFrame(robot_id, origin, detections, (None,) * unreadable)


def hold(hold_id: str = "01JABCDEFGHJKMNPQRSTVWXYZ0") -> Hold:
    """A hold of iVeg's."""
    return Hold(hold_id, "iveg", "remote")


def safety_report(
    robot_id: str = "AGI",
    *holds: Hold,
    speed_factor: float = 1.0,
    reason: str = "clear",
    cause: str | None = None,
    decision_id: str | None = None,
    released: tuple[str, ...] = (),
    challenge: str = "0123456789abcdef",
    linear: float = 0.0,
    angular: float = 0.0,
    feedback_age_s: float | None = 0.1,
    origin: Origin = origin(),  # noqa: B008 - a frozen value
) -> SafetyReport:
    return SafetyReport(
        robot_id,
        origin,
        speed_factor,
        reason,
        cause,
        decision_id,
        holds,
        released,
        challenge,
        linear,
        angular,
        feedback_age_s,
    )


def ignore(*_: object) -> None:
    """A listener to whom nothing matters."""


def received(
    observation: Observation, *, after: float = 0.0, transport: TransportId = FIWARE.id
) -> Received:
    """An observation that came ``after`` seconds from the start."""
    return Received(observation, at(after), transport)


def notification(
    attributes: Mapping[str, object] | None = None,
    *,
    robot_id: str = "AGI",
    entity_type: str = "Robot",
    subscription_id: str = "507f1f77bcf86cd799439011",
) -> bytes:
    """What Orion posts, normalized; by default one pose."""
    if attributes is None:
        attributes = {"base_pose_ground_truth": pose_value()}
    entity: dict[str, object] = {"id": robot_id, "type": entity_type}
    for name, value in attributes.items():
        entity[name] = {"type": "object", "value": value, "metadata": {}}
    return orjson.dumps({"subscriptionId": subscription_id, "data": [entity]})


def pose_value(
    x: float = 0.0, y: float = 0.0, *, seq: int = 1, boot: str | None = "boot-a"
) -> dict[str, object]:
    """The value of ``base_pose_ground_truth``."""
    return {
        "x": x,
        "y": y,
        "yaw": 0.0,
        "linear_velocity": 0.5,
        "angular_velocity": 0.0,
        "boot": boot,
        "seq": seq,
        "stamp": format_stamp(START.wall),
    }
