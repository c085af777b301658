"""Names and qualities of service as ROS 2 puts them on DDS."""

import pytest

from iveg.domain.errors import UnreadableError
from iveg.ros2 import messages as ros
from iveg.ros2 import names
from iveg.ros2.names import Qos


def test_a_topic_and_a_type_are_named_on_dds_as_ros_names_them() -> None:
    dds = "nav_msgs::msg::dds_::Odometry_"

    assert names.dds_topic("/agi/odom") == "rt/agi/odom"
    assert names.ros_topic("rt/agi/odom") == "/agi/odom"
    assert names.ros_topic("rtodom") is None
    assert names.dds_type(ros.Odometry.ROS) == dds
    assert names.ros_type(dds) == "nav_msgs/msg/Odometry"


@pytest.mark.parametrize(
    ("name", "namespace", "full"),
    [("odom", "", "/odom"), ("a/b", "agi/", "/agi/a/b"), ("/tf", "/agi", "/tf")],
)
def test_a_relative_name_is_below_the_namespace(
    name: str, namespace: str, full: str
) -> None:
    assert names.full_name(name, namespace) == full


@pytest.mark.parametrize("name", ["", "/", "a//b", "1odom", "odom/", "a b", "~/odom"])
def test_what_cannot_name_a_topic_is_refused(name: str) -> None:
    with pytest.raises(UnreadableError, match="bad_topic"):
        names.full_name(name)


@pytest.mark.parametrize(
    ("asked", "offered", "heard"),
    [
        (Qos(reliable=False), Qos(reliable=True), True),
        (Qos(reliable=True), Qos(reliable=False), False),
        (Qos(transient_local=True), Qos(), False),
        (Qos(), Qos(transient_local=True), True),
    ],
)
def test_a_reader_is_served_by_a_writer_that_offers_no_less(
    asked: Qos, offered: Qos, *, heard: bool
) -> None:
    assert (asked.lacks(offered) == "") is heard
