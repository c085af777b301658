"""A running gate looks round: what endpoints of others give away is a fault."""

import pytest

from iveg.robot.ros2.config import DriveConfig, RobotConfig
from iveg.robot.ros2.input_faults import InputFaults, speed_of
from iveg.robot.ros2.lookout import Lookout, forms_published
from iveg.ros2 import detector_messages as d
from iveg.ros2 import geometry_msgs, nav_msgs, sensor_msgs, vision_msgs
from iveg.ros2.names import SENSOR_DATA, TF_STATIC, Endpoint, Qos
from tests.fakes.ros2_network import endpoint

BASE = endpoint("/cmd_vel", geometry_msgs.Twist, writes=False)
STAMPED_BASE = endpoint("/cmd_vel", geometry_msgs.TwistStamped, writes=False)


def faults(
    *others: Endpoint, config: RobotConfig | None = None, after: float = 0.0
) -> dict[str, str]:
    """Code → what about, ``after`` seconds of these endpoints."""
    noted = InputFaults()
    lookout = Lookout(config or RobotConfig(), noted, 100.0)
    lookout.look(others, 100.0)
    lookout.look(others, 100.0 + after)
    return {one.code: one.about for one in noted.faults(100.0 + after)}


def test_a_base_that_hears_the_gate_is_no_fault() -> None:
    assert faults(BASE, after=60.0) == {}


@pytest.mark.parametrize(
    ("base", "config", "about"),
    [
        (
            STAMPED_BASE,
            RobotConfig(),
            "/cmd_vel: Twist → TwistStamped",
        ),
        (
            BASE,
            RobotConfig(drive=DriveConfig(stamped_out=True)),
            "/cmd_vel: TwistStamped → Twist",
        ),
        (
            endpoint("/cmd_vel", geometry_msgs.Twist, writes=False, qos=TF_STATIC),
            RobotConfig(),
            "/cmd_vel: volatile → transient local",
        ),
        (
            BASE,
            RobotConfig(
                qualities={**RobotConfig().qualities, "cmd_vel_out": SENSOR_DATA}
            ),
            "/cmd_vel: best effort → reliable",
        ),
    ],
)
def test_a_base_that_cannot_hear_the_gate_is_named_at_once(
    base: Endpoint, config: RobotConfig, about: str
) -> None:
    assert faults(base, config=config) == {"drive_unheard": about}


def test_a_drive_on_which_nobody_listens_is_named_after_discovery() -> None:
    odometry = endpoint("/odom", nav_msgs.Odometry)

    assert faults(odometry, after=4.0) == {}
    assert faults(odometry, after=5.5) == {"drive_unheard": "/cmd_vel"}


def test_an_unheard_drive_slows_nobody() -> None:
    noted = InputFaults()
    noted.note("drive_unheard", "/cmd_vel", 0.0)

    assert speed_of(noted.faults(0.0)) == (1.0, None)


def test_a_topic_of_a_type_that_is_not_read_is_named_with_it() -> None:
    scan = endpoint("/scan", sensor_msgs.PointCloud2)

    assert faults(BASE, scan) == {"wrong_type": "/scan: sensor_msgs/PointCloud2"}


@pytest.mark.parametrize(
    "message", [vision_msgs.Detection3DArray, d.BoundingBoxes3d, d.DetectionArray]
)
def test_a_detector_of_a_family_that_is_read_is_no_fault(message: type) -> None:
    assert faults(BASE, endpoint("/detections_3d", message)) == {}


def test_types_are_told_as_others_publish_them() -> None:
    seen = [
        endpoint("/boxes", d.BoundingBoxes),
        endpoint("/boxes", d.BoundingBoxes, qos=Qos(reliable=False)),
        endpoint("/boxes", vision_msgs.Detection2DArray, own=True),
        endpoint("/boxes", vision_msgs.Detection2DArray, writes=False),
        endpoint("/boxes", sensor_msgs.PointCloud2),
    ]

    assert forms_published("detections_2d", "/boxes", seen) == [d.BoundingBoxes]
