"""What endpoints on DDS tell a gate, and the check."""

from dataclasses import replace
from typing import Any

import pytest

from iveg.domain.observations import RobotFault
from iveg.robot.ros2.checking import CheckRow, Lookout, judge
from iveg.robot.ros2.config import QualityTable, RobotConfig
from iveg.robot.ros2.reading import InputFaults, speed_of
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.cdr import type_hash
from iveg.ros2.messages import Message
from iveg.ros2.names import DEFAULT, SENSOR_DATA, TF, TF_STATIC, Endpoint
from tests.fakes.ros2_network import endpoint

# --- lookout ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("form", "config", "about"),
    [
        (ros.TwistStamped, RobotConfig(), "/cmd_vel: Twist → TwistStamped"),
        (
            ros.Twist,
            RobotConfig(qos={"cmd_vel_out": QualityTable(reliable=False)}),
            "/cmd_vel: best effort → reliable",
        ),
    ],
)
def test_a_base_that_cannot_hear_the_gate_is_named_at_once(
    form: type[Message], config: RobotConfig, about: str
) -> None:
    noted = InputFaults()

    Lookout(config, noted, 100.0).look(
        (endpoint("/cmd_vel", form, writes=False),), 100.0
    )

    found = [(one.code, one.about) for one in noted.faults(100.0)]
    assert found == [("drive_unheard", about)]


@pytest.mark.parametrize("others", [(), (endpoint("/odom", ros.Odometry),)])
def test_a_gate_that_no_base_hears_halves_the_speed(
    others: tuple[Endpoint, ...],
) -> None:
    noted = InputFaults()

    Lookout(RobotConfig(), noted, 100.0).look(others, 105.5)

    assert speed_of(noted.faults(105.5)) == (0.5, "drive_unheard")


# --- checking ---------------------------------------------------------------------

WHOLE = {
    "odometry": endpoint("/odom", ros.Odometry),
    "scan": endpoint("/scan", ros.LaserScan, qos=SENSOR_DATA),
    "tf": endpoint("/tf", ros.TFMessage, qos=TF),
    "tf_static": endpoint("/tf_static", ros.TFMessage, qos=TF_STATIC),
    "seen": endpoint("/detections_3d", ros.Detection3DArray),
    "wishes": endpoint("/cmd_vel_nav", ros.Twist),
    "base": endpoint("/cmd_vel", ros.Twist, writes=False),
}
RATES = {"odometry": 30.0, "scan": 10.0, "tf": 30.0, "detections_3d": 10.0}
FOREIGN = Endpoint("/detections_3d", "darknet_msgs/msg/Boxes", True, DEFAULT, False)
YOLACT = endpoint("/detections_3d", d.BoundingBoxes3d)


def judged(
    *more: Endpoint,
    without: str = "",
    config: RobotConfig | None = None,
    faults: tuple[RobotFault, ...] = (),
    has_detector: bool = True,
    **rates: float,
) -> tuple[CheckRow, ...]:
    endpoints = [one for name, one in WHOLE.items() if name != without]
    return judge(
        config or RobotConfig(),
        [*endpoints, *more],
        {key: (rate, "odom") for key, rate in (RATES | rates).items()},
        faults,
        robot_id="AGI",
        has_detector=has_detector,
    )


def wrong(*more: Endpoint, **differs: Any) -> dict[str, str]:
    """Topic → verdict, of those that have one."""
    rows = judged(*more, **differs)
    return {row.topic: row.verdict for row in rows if row.verdict}


def test_a_robot_that_has_everything_has_a_row_for_each_topic() -> None:
    odom = CheckRow("/odom", ros.Odometry.ROS, 1, 30.0, "reliable", "odom")

    assert judged()[0] == odom
    assert wrong() == {}


@pytest.mark.parametrize(
    ("found", "topic", "verdict"),
    [
        (wrong(without="odometry"), "/odom",
         "nobody publishes it (nav_msgs/msg/Odometry)"),
        (wrong(without="base"), "/cmd_vel", "drive_unheard"),
        (wrong(endpoint("/cmd_vel", ros.Twist)), "/cmd_vel",
         "second_publisher"),
        (wrong(replace(endpoint("/cmd_vel", ros.Twist), gate="AGII")),
         "/cmd_vel", "second_publisher"),
        (wrong(endpoint("/cmd_vel_nav", ros.Twist, writes=False)),
         "/cmd_vel_nav",
         "somebody listens beside the gate: a base would go round it"),
        (wrong(endpoint("/scan", ros.PointCloud2), without="scan"),
         "/scan", "wrong_type (sensor_msgs/PointCloud2)"),
        (wrong(endpoint("/tf", ros.TFMessage, qos=SENSOR_DATA)),
         "/tf", "another quality of service is asked for: qos.tf"),
        (wrong(odometry=1.0), "/odom", "slow"),
        (wrong(detections_3d=0.0), "/detections_3d", "silent"),
        (wrong(faults=(RobotFault("unreadable", "/detections_3d: a/B", 1.0),)),
         "/detections_3d", "unreadable (a/B)"),
        (wrong(faults=(RobotFault("no_transform", "map → odom", 1.0),)),
         "map → odom", "no_transform"),
        (wrong(endpoint("/cmd_vel", ros.Twist, writes=False, qos=TF_STATIC),
               without="base"), "/cmd_vel",
         "drive_unheard (volatile → transient local)"),
        (wrong(endpoint("/yolox/bounding_box", d.BoundingBoxes), without="seen",
               has_detector=False), "/yolox/bounding_box",
         "a detector's: topics.detections_2d"),
        (wrong(FOREIGN, without="seen"), "/detections_3d",
         "wrong_type (darknet_msgs/Boxes)"),
        (wrong(replace(YOLACT, type_hash="RIHS01_12"), without="seen"),
         "/detections_3d",
         f"other fields: RIHS01_12 there, {type_hash(d.BoundingBoxes3d)} here"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_beside_its_topic_alone(
    found: dict[str, str], topic: str, verdict: str
) -> None:
    assert found == {topic: verdict}


def test_beside_the_running_gate_only_others_are_told() -> None:
    gate = [
        replace(endpoint("/cmd_vel", ros.Twist), gate="AGI"),
        replace(endpoint("/cmd_vel_nav", ros.Twist, writes=False), gate="AGI"),
        replace(endpoint("/iveg/obstacles", ros.PointCloud2), gate="AGI"),
    ]

    assert wrong(*gate) == {}
    assert wrong(*gate, endpoint("/cmd_vel", ros.Twist)) == {
        "/cmd_vel": "second_publisher"
    }
