"""Type hashes against published ones, and against those that rosbags computes."""

import pytest

from iveg.ros2 import detector_messages as d
from iveg.ros2 import (
    geometry_msgs,
    nav_msgs,
    sensor_msgs,
    std_msgs,
    vision_msgs,
    visualization_msgs,
)
from iveg.ros2.schema import Message
from iveg.ros2.type_hash import definition, read_user_data, type_hash, user_data
from tests.unit.ros2.reference import STORE

PACKAGES = (
    std_msgs, geometry_msgs, nav_msgs, sensor_msgs, vision_msgs, visualization_msgs, d
)  # fmt: skip
MESSAGES = [
    one
    for module in PACKAGES
    for one in vars(module).values()
    if isinstance(one, type)
    and issubclass(one, Message)
    and hasattr(one, "ROS")
    and one.__module__ == module.__name__
]

PUBLISHED: dict[type[Message], str] = {
    geometry_msgs.Twist: (
        "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
    ),
    geometry_msgs.TwistStamped: (
        "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"
    ),
    nav_msgs.Odometry: (
        "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"
    ),
    sensor_msgs.LaserScan: (
        "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"
    ),
    geometry_msgs.TFMessage: (
        "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
    ),
    sensor_msgs.CameraInfo: (
        "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"
    ),
    visualization_msgs.MarkerArray: (
        "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"
    ),
    vision_msgs.Detection3DArray: (
        "793f5eab9595ac1c0da07873cc859db42eae51f0ee76056db8562515d830e018"
    ),
}
"""As nodes of ROS 2 Jazzy announced them on DDS."""


@pytest.mark.parametrize(
    ("message", "digest"), PUBLISHED.items(), ids=lambda one: getattr(one, "ROS", "")
)
def test_a_type_has_the_hash_that_ros_2_announces(
    message: type[Message], digest: str
) -> None:
    assert type_hash(message) == f"RIHS01_{digest}"


@pytest.mark.parametrize("message", MESSAGES, ids=lambda one: one.ROS)
def test_every_type_has_the_hash_of_its_definition(message: type[Message]) -> None:
    assert type_hash(message) == STORE.hash_rihs01(message.ROS)


def test_user_data_are_read_as_they_are_written() -> None:
    assert read_user_data(user_data(geometry_msgs.Twist)) == (
        type_hash(geometry_msgs.Twist),
        "",
    )
    assert read_user_data(user_data(geometry_msgs.Twist, "AGI-2")) == (
        type_hash(geometry_msgs.Twist),
        "AGI-2",
    )


@pytest.mark.parametrize("data", [b"", b"\0", b"\xff\xfe=;;=", b"typehash", b"a=b;\0"])
def test_user_data_of_others_are_no_hash(data: bytes) -> None:
    assert read_user_data(data) == ("", "")


def test_a_definition_is_what_the_msg_file_says() -> None:
    assert definition(d.BoundingBoxes) == (
        "std_msgs/Header header, std_msgs/Header image_header, "
        "bboxes_ex_msgs/BoundingBox[] bounding_boxes"
    )
    assert definition(geometry_msgs.PoseWithCovariance).endswith(
        "float64[36] covariance"
    )
