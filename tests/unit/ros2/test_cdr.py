"""Each message against bytes spelled out by hand, and against rosbags."""

from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.errors import UnreadableError
from iveg.ros2 import (
    cdr,
    geometry_msgs,
    nav_msgs,
    sensor_msgs,
    std_msgs,
    vision_msgs,
    visualization_msgs,
)
from tests.unit.ros2.reference import STORE, as_rosbags
from tests.unit.ros2.spelled import HALF, MAP, ONE, POSE, STAMP, TWO, ZERO, payload

AT_7_S = std_msgs.Time(7, 5)
IN_MAP = std_msgs.Header(AT_7_S, "map")
IN_ODOM = std_msgs.Header(AT_7_S, "odom")
HERE = geometry_msgs.Pose(geometry_msgs.Point(1.0, 2.0))
DRIVES = geometry_msgs.Twist(geometry_msgs.Vector3(0.5), geometry_msgs.Vector3(z=1.0))
TWIST = f"{HALF} {ZERO} {ZERO} {ZERO} {ZERO} {ONE}"
SURE = f"36*{ZERO}"


def _f(*numbers: float) -> Any:
    return np.array(numbers, np.float32)


def _b(*numbers: int) -> Any:
    return np.array(numbers, np.uint8)


def _seen(class_id: str) -> tuple[vision_msgs.ObjectHypothesisWithPose, ...]:
    sure = vision_msgs.ObjectHypothesis(class_id, 0.5)
    return (
        vision_msgs.ObjectHypothesisWithPose(
            sure, geometry_msgs.PoseWithCovariance(HERE)
        ),
    )


CASES: dict[str, tuple[Any, str]] = {
    "Twist": (DRIVES, TWIST),
    "TwistStamped, 16 bytes before it": (
        geometry_msgs.TwistStamped(IN_MAP, DRIVES),
        f"{STAMP} {MAP} {TWIST}",
    ),
    "TwistStamped, 17 bytes before it": (
        geometry_msgs.TwistStamped(IN_ODOM, DRIVES),
        f"{STAMP} 05000000 'odom' 7*-- {TWIST}",
    ),
    "Odometry, pose after 34 bytes": (
        nav_msgs.Odometry(
            IN_ODOM,
            "base_link",
            geometry_msgs.PoseWithCovariance(HERE),
            geometry_msgs.TwistWithCovariance(DRIVES),
        ),
        f"{STAMP} 05000000 'odom' 3*-- 0a000000 'base_link' 6*-- "
        f"{POSE} {SURE} {TWIST} {SURE}",
    ),
    "Odometry, pose after 22 bytes": (
        nav_msgs.Odometry(
            IN_MAP,
            "b",
            geometry_msgs.PoseWithCovariance(HERE),
            geometry_msgs.TwistWithCovariance(DRIVES),
        ),
        f"{STAMP} {MAP} 02000000 'b' 2*-- {POSE} {SURE} {TWIST} {SURE}",
    ),
    "LaserScan": (
        sensor_msgs.LaserScan(
            std_msgs.Header(AT_7_S, "laser"),
            *(1.0, 2.0, 0.5, 0.0, 0.25, 0.25, 10.0),
            _f(1.0, np.inf),
            _f(2.0),
        ),
        f"{STAMP} 06000000 'laser' 2*-- 0000803f 00000040 0000003f 00000000 "
        "0000803e 0000803e 00002041 02000000 0000803f 0000807f 01000000 00000040",
    ),
    "LaserScan without a beam": (
        sensor_msgs.LaserScan(IN_MAP),
        f"{STAMP} {MAP} 7*00000000 00000000 00000000",
    ),
    "TFMessage": (
        geometry_msgs.TFMessage(
            (
                geometry_msgs.TransformStamped(
                    IN_MAP,
                    "odom",
                    geometry_msgs.Transform(geometry_msgs.Vector3(1.0, 2.0)),
                ),
                geometry_msgs.TransformStamped(
                    IN_ODOM,
                    "base_link",
                    geometry_msgs.Transform(geometry_msgs.Vector3(1.0, 2.0)),
                ),
            )
        ),
        f"02000000 {STAMP} {MAP} 05000000 'odom' 3*-- {POSE} "
        f"{STAMP} 05000000 'odom' 3*-- 0a000000 'base_link' 6*-- {POSE}",
    ),
    "Path": (
        nav_msgs.Path(
            IN_MAP,
            (
                geometry_msgs.PoseStamped(IN_MAP, HERE),
                geometry_msgs.PoseStamped(IN_ODOM, HERE),
            ),
        ),
        f"{STAMP} {MAP} 02000000 {STAMP} {MAP} 4*-- {POSE} "
        f"{STAMP} 05000000 'odom' 7*-- {POSE}",
    ),
    "BatteryState": (
        sensor_msgs.BatteryState(
            IN_MAP,
            *(10.0, 2.0, -1.0, 1.0, 2.0, 2.0, 0.5),
            *(2, 1, 3, True),
            _f(1.0, 2.0),
            _f(),
            "",
            "x",
        ),
        f"{STAMP} {MAP} 00002041 00000040 000080bf 0000803f 00000040 00000040 "
        "0000003f 02 01 03 01 02000000 0000803f 00000040 00000000 01000000 '' "
        "3*-- 02000000 'x'",
    ),
    "Detection3DArray, score after 51 bytes": (
        vision_msgs.Detection3DArray(
            IN_MAP,
            (
                vision_msgs.Detection3D(
                    IN_MAP,
                    _seen("farmer"),
                    vision_msgs.BoundingBox3D(
                        HERE, geometry_msgs.Vector3(0.5, 0.5, 2.0)
                    ),
                    "7",
                ),
            ),
        ),
        f"{STAMP} {MAP} 01000000 {STAMP} {MAP} 01000000 07000000 'farmer' 5*-- {HALF} "
        f"{POSE} {SURE} {POSE} {HALF} {HALF} {TWO} 02000000 '7'",
    ),
    "Detection3DArray, score after 46 bytes": (
        vision_msgs.Detection3DArray(
            IN_MAP, (vision_msgs.Detection3D(IN_MAP, _seen("x")),)
        ),
        f"{STAMP} {MAP} 01000000 {STAMP} {MAP} 01000000 02000000 'x' 2*-- {HALF} "
        f"{POSE} {SURE} 6*{ZERO} {ONE} 3*{ZERO} 01000000 ''",
    ),
    "Detection2DArray": (
        vision_msgs.Detection2DArray(
            IN_MAP,
            (
                vision_msgs.Detection2D(
                    IN_MAP,
                    _seen("person"),
                    vision_msgs.BoundingBox2D(
                        vision_msgs.PicturePose(vision_msgs.Point2D(1.0, 2.0), 0.0),
                        0.5,
                        2.0,
                    ),
                    "",
                ),
            ),
        ),
        f"{STAMP} {MAP} 01000000 {STAMP} {MAP} 01000000 07000000 'person' 5*-- {HALF} "
        f"{POSE} {SURE} {ONE} {TWO} {ZERO} {HALF} {TWO} 01000000 ''",
    ),
    "Detection2DArray, score after 46 bytes": (
        vision_msgs.Detection2DArray(
            IN_MAP, (vision_msgs.Detection2D(IN_MAP, _seen("x"), id="12"),)
        ),
        f"{STAMP} {MAP} 01000000 {STAMP} {MAP} 01000000 02000000 'x' 2*-- {HALF} "
        f"{POSE} {SURE} 5*{ZERO} 03000000 '12'",
    ),
    "Image": (
        sensor_msgs.Image(IN_MAP, 1, 2, "16UC1", 0, 4, _b(1, 2, 3, 4)),
        f"{STAMP} {MAP} 01000000 02000000 06000000 '16UC1' 00 -- 04000000 04000000 "
        "01 02 03 04",
    ),
    "CameraInfo": (
        sensor_msgs.CameraInfo(
            IN_MAP,
            2,
            4,
            "",
            np.array([0.5]),
            np.ones(9),
            np.zeros(9),
            np.full(12, 2.0),
            0,
            1,
            sensor_msgs.RegionOfInterest(1, 2, 3, 4, True),
        ),
        f"{STAMP} {MAP} 02000000 04000000 01000000 '' 3*-- 01000000 4*-- {HALF} "
        f"9*{ONE} 9*{ZERO} 12*{TWO} 00000000 01000000 "
        "01000000 02000000 03000000 04000000 01",
    ),
    "CameraInfo without distortion": (
        sensor_msgs.CameraInfo(IN_MAP, 2, 4, "", np.zeros(0), np.ones(9)),
        f"{STAMP} {MAP} 02000000 04000000 01000000 '' 3*-- 00000000 4*-- "
        f"9*{ONE} 21*{ZERO} 2*00000000 4*00000000 00",
    ),
    "PointCloud2": (
        sensor_msgs.PointCloud2(
            IN_MAP,
            1,
            1,
            (sensor_msgs.PointField("x", 0, 7, 1),),
            False,
            4,
            4,
            _b(0, 0, 128, 63),
            True,
        ),
        f"{STAMP} {MAP} 01000000 01000000 01000000 02000000 'x' 2*-- 00000000 07 3*-- "
        "01000000 00 3*-- 04000000 04000000 04000000 00 00 80 3f 01",
    ),
    "OccupancyGrid": (
        nav_msgs.OccupancyGrid(
            IN_MAP,
            nav_msgs.MapMetaData(AT_7_S, 0.5, 3, 1, HERE),
            np.array([-1, 0, 100], np.int8),
        ),
        f"{STAMP} {MAP} {STAMP} 0000003f 03000000 01000000 4*-- {POSE} "
        "03000000 ff 00 64",
    ),
    "MarkerArray, pose after 40 bytes": (
        visualization_msgs.MarkerArray(
            (
                visualization_msgs.Marker(
                    IN_MAP,
                    "p",
                    *(7, 3, 0),
                    HERE,
                    geometry_msgs.Vector3(2.0, 2.0, 0.5),
                    std_msgs.ColorRGBA(1.0, 0.5, 0.0, 0.5),
                    std_msgs.Duration(1, 0),
                ),
            )
        ),
        f"01000000 {STAMP} {MAP} 02000000 'p' 2*-- 07000000 03000000 00000000 "
        f"{POSE} {TWO} {TWO} {HALF} 0000803f 0000003f 00000000 0000003f "
        "01000000 00000000 00 3*-- 00000000 00000000 "
        "01000000 '' 3*-- 00000000 00000000 01000000 '' 3*-- 01000000 '' 3*-- "
        "00000000 00000000 01000000 '' 3*-- 01000000 '' 3*-- 01000000 '' 3*-- "
        "00000000 00",
    ),
    "MarkerArray, pose after 48 bytes": (
        visualization_msgs.MarkerArray(
            (
                visualization_msgs.Marker(
                    IN_MAP,
                    "people",
                    *(7, 3, 0),
                    HERE,
                    geometry_msgs.Vector3(2.0, 2.0, 0.5),
                    std_msgs.ColorRGBA(1.0, 0.5, 0.0, 0.5),
                    std_msgs.Duration(1, 0),
                    points=(geometry_msgs.Point(1.0),),
                    text="hi",
                ),
            )
        ),
        f"01000000 {STAMP} {MAP} 07000000 'people' -- 07000000 03000000 00000000 4*-- "
        f"{POSE} {TWO} {TWO} {HALF} 0000803f 0000003f 00000000 0000003f "
        f"01000000 00000000 00 3*-- 01000000 {ONE} {ZERO} {ZERO} 00000000 "
        "01000000 '' 3*-- 00000000 00000000 01000000 '' 3*-- 01000000 '' 3*-- "
        "00000000 00000000 03000000 'hi' -- 01000000 '' 3*-- 01000000 '' 3*-- "
        "00000000 00",
    ),
}


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("case", CASES)
def test_a_message_is_written_as_the_rules_of_cdr_say(
    case: str, order: Literal["<", ">"]
) -> None:
    message, words = CASES[case]

    assert cdr.write(message, order).hex(" ") == payload(words, order).hex(" ")


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("case", CASES)
def test_a_message_is_read_from_either_byte_order(
    case: str, order: Literal["<", ">"]
) -> None:
    message, words = CASES[case]

    read = cdr.read(type(message), payload(words, order))

    assert repr(read) == repr(message)


@pytest.mark.parametrize("case", CASES)
def test_rosbags_reads_and_writes_the_same_bytes(case: str) -> None:
    message, _ = CASES[case]
    ours = cdr.write(message)

    theirs = STORE.deserialize_cdr(ours, message.ROS)

    assert bytes(STORE.serialize_cdr(theirs, message.ROS)) == ours
    assert bytes(STORE.serialize_cdr(as_rosbags(message), message.ROS)) == ours


@pytest.mark.parametrize("case", CASES)
def test_bytes_that_break_off_are_unreadable_and_nothing_worse(case: str) -> None:
    message, words = CASES[case]
    whole = payload(words, "<")

    for size in range(len(whole)):
        with pytest.raises(UnreadableError):
            cdr.read(type(message), whole[:size])


@given(st.sampled_from(sorted(CASES)), st.binary(max_size=200), st.integers(0, 1))
def test_whatever_bytes_come_are_a_message_or_unreadable(
    case: str, junk: bytes, order: int
) -> None:
    message, _ = CASES[case]
    bytes_ = bytes((0, order, 0, 0)) + junk

    try:
        read = cdr.read(type(message), bytes_)
    except UnreadableError:
        return

    assert isinstance(read, type(message))


def test_a_count_that_no_message_can_hold_takes_no_memory() -> None:
    bytes_ = payload("ffffff7f", "<") + bytes(64)

    with pytest.raises(UnreadableError, match="too_short"):
        cdr.read(geometry_msgs.TFMessage, bytes_)


@pytest.mark.parametrize("head", ["00060000", "00020000", "01010000", ""])
def test_another_encapsulation_is_named(head: str) -> None:
    with pytest.raises(UnreadableError, match="bad_encapsulation"):
        cdr.read(geometry_msgs.Twist, bytes.fromhex(head) + bytes(48 if head else 0))


def test_a_stamp_keeps_its_nanoseconds() -> None:
    assert std_msgs.Time.of(1700000000.25) == std_msgs.Time(1700000000, 250_000_000)
    assert std_msgs.Time(3, 500_000_000).seconds == 3.5
    assert std_msgs.Time.of(-0.25) == std_msgs.Time(-1, 750_000_000)
