"""``iveg robot check`` says in one sentence each what is missing."""

from dataclasses import replace

import pytest

from iveg.robot.ros2.checking import Heard, judge
from iveg.robot.ros2.config import DriveConfig, RobotConfig
from iveg.robot.ros2.transforms import TransformBuffer
from iveg.robot.ros2.verdict import CheckVerdict, lines
from iveg.ros2 import detector_messages as d
from iveg.ros2 import geometry_msgs, nav_msgs, sensor_msgs
from iveg.ros2.names import DEFAULT, SENSOR_DATA, TF, TF_STATIC, Endpoint
from iveg.ros2.type_hash import type_hash
from tests.fakes.ros2_network import endpoint
from tests.unit.robot.ros2.said import WALL, link, tf

WHOLE = {
    "odometry": endpoint("/odom", nav_msgs.Odometry),
    "scan": endpoint("/scan", sensor_msgs.LaserScan, qos=SENSOR_DATA),
    "tf": endpoint("/tf", geometry_msgs.TFMessage, qos=TF),
    "tf_static": endpoint("/tf_static", geometry_msgs.TFMessage, qos=TF_STATIC),
    "wishes": endpoint("/cmd_vel_nav", geometry_msgs.Twist),
    "base": endpoint("/cmd_vel", geometry_msgs.Twist, writes=False),
}
FOREIGN = Endpoint("/detections_3d", "darknet_msgs/msg/Boxes", True, DEFAULT, False)


def tree(*, localised: bool = True) -> TransformBuffer:
    found = TransformBuffer(0.5)
    found.add(tf(link("base_link", "laser")), static=True)
    found.add(tf(link("odom", "base_link")), static=False)
    if localised:
        found.add(tf(link("map", "odom")), static=False)
    return found


def heard(**differs: int) -> dict[str, Heard]:
    counts = {"odometry": 90, "scan": 30, "tf": 90, "tf_static": 1} | differs
    return {
        topic: Heard(count, 0, 0.02, "laser" if topic == "scan" else "odom")
        for topic, count in counts.items()
    }


def verdict(
    *more: Endpoint,
    without: str = "",
    config: RobotConfig | None = None,
    said: dict[str, Heard] | None = None,
    buffer: TransformBuffer | None = None,
    broker: str | None = None,
    stamp: float = WALL,
) -> CheckVerdict:
    endpoints = [one for name, one in WHOLE.items() if name != without]
    return judge(
        config or RobotConfig(),
        [*endpoints, *more],
        said or heard(),
        buffer or tree(),
        seconds=3.0,
        stamp=stamp,
        broker=broker,
        robot_id="AGI",
    )


def test_a_robot_that_has_everything_misses_nothing() -> None:
    found = verdict()

    assert found.missing == ()
    assert found.chain == "map → odom → base_link → laser"
    odometry = next(row for row in found.rows if row.topic == "/odom")
    assert (odometry.writers, odometry.rate_hz, odometry.age_s) == (1, 30.0, 0.02)
    assert lines(found)[-1] == "Nothing is missing."


@pytest.mark.parametrize(
    ("found", "sentence"),
    [
        (
            verdict(without="odometry"),
            "Nobody publishes /odom (nav_msgs/msg/Odometry): without it the robot "
            "stands.",
        ),
        (
            verdict(without="base"),
            "Nobody listens on /cmd_vel: is the base running?",
        ),
        (
            verdict(without="wishes"),
            "Nobody publishes /cmd_vel_nav: is navigation running?",
        ),
        (
            verdict(endpoint("/cmd_vel", geometry_msgs.Twist)),
            "Somebody else publishes /cmd_vel: only the gate may, remap it to "
            "/cmd_vel_nav.",
        ),
        (
            verdict(endpoint("/cmd_vel_nav", geometry_msgs.Twist, writes=False)),
            "Somebody listens on /cmd_vel_nav beside the gate: a base that does goes "
            "round it.",
        ),
        (
            verdict(endpoint("/scan", sensor_msgs.PointCloud2), without="scan"),
            "/scan is sensor_msgs/msg/PointCloud2, not sensor_msgs/msg/LaserScan.",
        ),
        (
            verdict(
                endpoint("/tf", geometry_msgs.TFMessage, qos=SENSOR_DATA), without="tf"
            ),
            "/tf: asked for reliably, published best effort; qos.tf.reliable = false.",
        ),
        (
            verdict(
                endpoint("/tf_static", geometry_msgs.TFMessage), without="tf_static"
            ),
            "/tf_static: asked for transient local, published volatile; "
            "qos.tf_static.transient_local = false.",
        ),
        (
            verdict(said=heard(odometry=3)),
            "/odom has a publisher and comes 1.0 times a second.",
        ),
        (
            verdict(buffer=tree(localised=False)),
            "TF: no map → odom.",
        ),
        (
            verdict(config=RobotConfig(drive=DriveConfig(stamped_out=True))),
            "/cmd_vel is geometry_msgs/msg/Twist there: drive.stamped_out.",
        ),
        (
            verdict(config=RobotConfig(drive=DriveConfig(stamped_in=True))),
            "/cmd_vel_nav is geometry_msgs/msg/Twist there: drive.stamped_in.",
        ),
        (verdict(broker="No MQTT broker answers."), "No MQTT broker answers."),
        (
            verdict(endpoint("/odom", sensor_msgs.PointCloud2)),
            "/odom is published as nav_msgs/msg/Odometry and as "
            "sensor_msgs/msg/PointCloud2: one may be right.",
        ),
        (
            verdict(replace(endpoint("/cmd_vel", geometry_msgs.Twist), gate="AGII")),
            "The gate of AGII publishes /cmd_vel: only the gate may, remap it to "
            "/cmd_vel_nav.",
        ),
        (
            verdict(
                endpoint("/cmd_vel", geometry_msgs.Twist, writes=False, qos=TF_STATIC),
                without="base",
            ),
            "/cmd_vel, offered → asked: volatile → transient local; qos.cmd_vel_out.",
        ),
        (
            verdict(endpoint("/yolact_coordinate", d.BoundingBoxes3d)),
            "/yolact_coordinate is a detector's "
            "(gb_visual_detection_3d_msgs/msg/BoundingBoxes3d): topics.detections_3d.",
        ),
        (
            verdict(endpoint("/yolox/bounding_box", d.BoundingBoxes)),
            "/yolox/bounding_box is a detector's (bboxes_ex_msgs/msg/BoundingBoxes): "
            "topics.detections_2d.",
        ),
        (
            verdict(endpoint("/yolo/tracking", d.DetectionArray)),
            "/yolo/tracking is a detector's (yolo_msgs/msg/DetectionArray): "
            "topics.detections_3d or topics.detections_2d.",
        ),
        (
            verdict(replace(FOREIGN, type_hash="RIHS01_12")),
            "/detections_3d is darknet_msgs/msg/Boxes (RIHS01_12), not "
            "vision_msgs/msg/Detection3DArray or "
            "gb_visual_detection_3d_msgs/msg/BoundingBoxes3d or "
            "yolo_msgs/msg/DetectionArray.",
        ),
        (
            verdict(
                replace(
                    endpoint("/detections_3d", d.BoundingBoxes3d), type_hash="RIHS01_12"
                )
            ),
            "/detections_3d is another gb_visual_detection_3d_msgs/msg/BoundingBoxes3d:"
            f" RIHS01_12 there, {type_hash(d.BoundingBoxes3d)} here (std_msgs/Header "
            "header, gb_visual_detection_3d_msgs/BoundingBox3d[] bounding_boxes).",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_missing_is_said_in_one_sentence(
    found: CheckVerdict, sentence: str
) -> None:
    assert list(found.missing) == [sentence]


def test_a_domain_where_nobody_is_says_so_once() -> None:
    found = judge(
        RobotConfig(domain=7),
        [endpoint("/cmd_vel", geometry_msgs.Twist, own=True)],
        {},
        TransformBuffer(),
        seconds=3.0,
        stamp=WALL,
        broker=None,
    )

    (sentence,) = found.missing
    assert "DDS domain 7" in sentence


def test_without_odometry_transforms_are_not_called_missing() -> None:
    counts = heard()
    del counts["odometry"]

    found = verdict(without="odometry", said=counts, stamp=0.0)

    assert [one for one in found.missing if one.startswith("TF")] == []
    assert len(found.missing) == 1


def test_without_odometry_a_broken_chain_is_still_told() -> None:
    found = verdict(buffer=tree(localised=False), stamp=0.0)

    assert found.missing == ("TF: no map → odom.",)


def test_beside_the_running_gate_the_check_knows_it() -> None:
    gate = [
        replace(endpoint("/cmd_vel", geometry_msgs.Twist), gate="AGI"),
        replace(
            endpoint("/cmd_vel_nav", geometry_msgs.Twist, writes=False), gate="AGI"
        ),
        replace(endpoint("/iveg/obstacles", sensor_msgs.PointCloud2), gate="AGI"),
    ]

    found = verdict(*gate)

    assert (found.missing, found.gate) == ((), "AGI")
    assert "The gate of AGI is running." in lines(found)


def test_a_second_publisher_beside_the_running_gate_is_still_told() -> None:
    gate = replace(endpoint("/cmd_vel", geometry_msgs.Twist), gate="AGI")

    (sentence,) = verdict(gate, endpoint("/cmd_vel", geometry_msgs.Twist)).missing

    assert sentence.startswith("Somebody else publishes /cmd_vel")


def test_a_detector_that_the_file_names_makes_others_none_of_its_business() -> None:
    named = endpoint("/detections_3d", d.BoundingBoxes3d)

    assert verdict(named, endpoint("/yolox/bounding_box", d.BoundingBoxes)) == (
        verdict(named)
    )
