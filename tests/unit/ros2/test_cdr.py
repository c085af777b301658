"""Messages against bytes spelled out by hand, and types against published hashes."""

from dataclasses import fields
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.errors import UnreadableError
from iveg.ros2 import cdr
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.cdr import read_user_data, type_hash, user_data
from iveg.ros2.messages import Message
from tests.unit.ros2.spelled import HALF, MAP, ONE, POSE, STAMP, TWO, ZERO, payload

# --- cdr --------------------------------------------------------------------------

AT_7_S = ros.Time(7, 5)
IN_MAP = ros.Header(AT_7_S, "map")
IN_ODOM = ros.Header(AT_7_S, "odom")
HERE = ros.Pose(ros.Point(1.0, 2.0))
DRIVES = ros.Twist(ros.Vector3(0.5), ros.Vector3(z=1.0))
TWIST = f"{HALF} {ZERO} {ZERO} {ZERO} {ZERO} {ONE}"
SURE = f"36*{ZERO}"


def _f(*numbers: float) -> Any:
    return np.array(numbers, np.float32)


def _b(*numbers: int) -> Any:
    return np.array(numbers, np.uint8)


def _seen(class_id: str) -> tuple[ros.ObjectHypothesisWithPose, ...]:
    sure = ros.ObjectHypothesis(class_id, 0.5)
    return (ros.ObjectHypothesisWithPose(sure, ros.PoseWithCovariance(HERE)),)


CASES: dict[str, tuple[Any, str]] = {
    "Twist": (DRIVES, TWIST),
    "TwistStamped, 16 bytes before it": (
        ros.TwistStamped(IN_MAP, DRIVES),
        f"{STAMP} {MAP} {TWIST}",
    ),
    "TwistStamped, 17 bytes before it": (
        ros.TwistStamped(IN_ODOM, DRIVES),
        f"{STAMP} 05000000 'odom' 7*-- {TWIST}",
    ),
    "Odometry, pose after 34 bytes": (
        ros.Odometry(
            IN_ODOM,
            "base_link",
            ros.PoseWithCovariance(HERE),
            ros.TwistWithCovariance(DRIVES),
        ),
        f"{STAMP} 05000000 'odom' 3*-- 0a000000 'base_link' 6*-- "
        f"{POSE} {SURE} {TWIST} {SURE}",
    ),
    "Odometry, pose after 22 bytes": (
        ros.Odometry(
            IN_MAP,
            "b",
            ros.PoseWithCovariance(HERE),
            ros.TwistWithCovariance(DRIVES),
        ),
        f"{STAMP} {MAP} 02000000 'b' 2*-- {POSE} {SURE} {TWIST} {SURE}",
    ),
    "LaserScan": (
        ros.LaserScan(
            ros.Header(AT_7_S, "laser"),
            *(1.0, 2.0, 0.5, 0.0, 0.25, 0.25, 10.0),
            _f(1.0, np.inf),
            _f(2.0),
        ),
        f"{STAMP} 06000000 'laser' 2*-- 0000803f 00000040 0000003f 00000000 "
        "0000803e 0000803e 00002041 02000000 0000803f 0000807f 01000000 00000040",
    ),
    "LaserScan without a beam": (
        ros.LaserScan(IN_MAP),
        f"{STAMP} {MAP} 7*00000000 00000000 00000000",
    ),
    "TFMessage": (
        ros.TFMessage(
            (
                ros.TransformStamped(
                    IN_MAP,
                    "odom",
                    ros.Transform(ros.Vector3(1.0, 2.0)),
                ),
                ros.TransformStamped(
                    IN_ODOM,
                    "base_link",
                    ros.Transform(ros.Vector3(1.0, 2.0)),
                ),
            )
        ),
        f"02000000 {STAMP} {MAP} 05000000 'odom' 3*-- {POSE} "
        f"{STAMP} 05000000 'odom' 3*-- 0a000000 'base_link' 6*-- {POSE}",
    ),
    "Path": (
        ros.Path(
            IN_MAP,
            (
                ros.PoseStamped(IN_MAP, HERE),
                ros.PoseStamped(IN_ODOM, HERE),
            ),
        ),
        f"{STAMP} {MAP} 02000000 {STAMP} {MAP} 4*-- {POSE} "
        f"{STAMP} 05000000 'odom' 7*-- {POSE}",
    ),
    "BatteryState": (
        ros.BatteryState(
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
        ros.Detection3DArray(
            IN_MAP,
            (
                ros.Detection3D(
                    IN_MAP,
                    _seen("farmer"),
                    ros.BoundingBox3D(HERE, ros.Vector3(0.5, 0.5, 2.0)),
                    "7",
                ),
            ),
        ),
        f"{STAMP} {MAP} 01000000 {STAMP} {MAP} 01000000 07000000 'farmer' 5*-- {HALF} "
        f"{POSE} {SURE} {POSE} {HALF} {HALF} {TWO} 02000000 '7'",
    ),
    "Detection3DArray, score after 46 bytes": (
        ros.Detection3DArray(IN_MAP, (ros.Detection3D(IN_MAP, _seen("x")),)),
        f"{STAMP} {MAP} 01000000 {STAMP} {MAP} 01000000 02000000 'x' 2*-- {HALF} "
        f"{POSE} {SURE} 6*{ZERO} {ONE} 3*{ZERO} 01000000 ''",
    ),
    "Detection2DArray": (
        ros.Detection2DArray(
            IN_MAP,
            (
                ros.Detection2D(
                    IN_MAP,
                    _seen("person"),
                    ros.BoundingBox2D(
                        ros.PicturePose(ros.Point2D(1.0, 2.0), 0.0),
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
        ros.Detection2DArray(IN_MAP, (ros.Detection2D(IN_MAP, _seen("x"), id="12"),)),
        f"{STAMP} {MAP} 01000000 {STAMP} {MAP} 01000000 02000000 'x' 2*-- {HALF} "
        f"{POSE} {SURE} 5*{ZERO} 03000000 '12'",
    ),
    "Image": (
        ros.Image(IN_MAP, 1, 2, "16UC1", 0, 4, _b(1, 2, 3, 4)),
        f"{STAMP} {MAP} 01000000 02000000 06000000 '16UC1' 00 -- 04000000 04000000 "
        "01 02 03 04",
    ),
    "CameraInfo": (
        ros.CameraInfo(
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
            ros.RegionOfInterest(1, 2, 3, 4, True),
        ),
        f"{STAMP} {MAP} 02000000 04000000 01000000 '' 3*-- 01000000 4*-- {HALF} "
        f"9*{ONE} 9*{ZERO} 12*{TWO} 00000000 01000000 "
        "01000000 02000000 03000000 04000000 01",
    ),
    "CameraInfo without distortion": (
        ros.CameraInfo(IN_MAP, 2, 4, "", np.zeros(0), np.ones(9)),
        f"{STAMP} {MAP} 02000000 04000000 01000000 '' 3*-- 00000000 4*-- "
        f"9*{ONE} 21*{ZERO} 2*00000000 4*00000000 00",
    ),
    "PointCloud2": (
        ros.PointCloud2(
            IN_MAP,
            1,
            1,
            (ros.PointField("x", 0, 7, 1),),
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
        ros.OccupancyGrid(
            IN_MAP,
            ros.MapMetaData(AT_7_S, 0.5, 3, 1, HERE),
            np.array([-1, 0, 100], np.int8),
        ),
        f"{STAMP} {MAP} {STAMP} 0000003f 03000000 01000000 4*-- {POSE} "
        "03000000 ff 00 64",
    ),
    "MarkerArray, pose after 40 bytes": (
        ros.MarkerArray(
            (
                ros.Marker(
                    IN_MAP,
                    "p",
                    *(7, 3, 0),
                    HERE,
                    ros.Vector3(2.0, 2.0, 0.5),
                    ros.ColorRGBA(1.0, 0.5, 0.0, 0.5),
                    ros.Duration(1, 0),
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
        ros.MarkerArray(
            (
                ros.Marker(
                    IN_MAP,
                    "people",
                    *(7, 3, 0),
                    HERE,
                    ros.Vector3(2.0, 2.0, 0.5),
                    ros.ColorRGBA(1.0, 0.5, 0.0, 0.5),
                    ros.Duration(1, 0),
                    points=(ros.Point(1.0),),
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


@pytest.mark.parametrize("case", CASES)
def test_a_message_is_written_as_the_rules_of_cdr_say(case: str) -> None:
    message, words = CASES[case]

    assert cdr.write(message).hex(" ") == payload(words, "<").hex(" ")


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("case", CASES)
def test_a_message_is_read_from_either_byte_order(
    case: str, order: Literal["<", ">"]
) -> None:
    message, words = CASES[case]

    read = cdr.read(type(message), payload(words, order))

    assert type(read) is type(message)
    assert cdr.write(read) == cdr.write(message)


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

    with pytest.raises(UnreadableError, match="unreadable"):
        cdr.read(ros.TFMessage, bytes_)


def test_more_than_padding_after_a_message_is_another_message() -> None:
    twist = cdr.write(DRIVES)

    assert cdr.read(ros.Twist, twist + bytes(3)) == DRIVES
    with pytest.raises(UnreadableError, match="unreadable"):
        cdr.read(ros.Twist, twist + bytes(4))


@pytest.mark.parametrize("head", ["00060000", "00020000", "01010000", ""])
def test_another_encapsulation_is_unreadable(head: str) -> None:
    with pytest.raises(UnreadableError, match="unreadable"):
        cdr.read(ros.Twist, bytes.fromhex(head) + bytes(48 if head else 0))


def test_a_stamp_keeps_its_nanoseconds() -> None:
    assert ros.Time.of(1700000000.25) == ros.Time(1700000000, 250_000_000)
    assert ros.Time(3, 500_000_000).seconds == 3.5
    assert ros.Time.of(-0.25) == ros.Time(-1, 750_000_000)


# --- type hash --------------------------------------------------------------------

MESSAGES = [
    one
    for module in (ros, d)
    for one in vars(module).values()
    if isinstance(one, type)
    and issubclass(one, Message)
    and hasattr(one, "ROS")
    and one.__module__ == module.__name__
]

PUBLISHED: dict[type[Message], str] = {
    ros.Twist: ("9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"),
    ros.TwistStamped: (
        "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"
    ),
    ros.Odometry: ("3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"),
    ros.LaserScan: ("64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"),
    ros.TFMessage: ("e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"),
    ros.CameraInfo: (
        "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"
    ),
    ros.MarkerArray: (
        "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"
    ),
    ros.Detection3DArray: (
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
def test_every_message_has_the_fields_of_its_definition_in_order(
    message: type[Message],
) -> None:
    _, defined = message.STORE.fielddefs[message.ROS]

    assert [one.name for one in fields(message)] == [name for name, _ in defined]


def test_user_data_are_read_as_they_are_written() -> None:
    assert read_user_data(user_data(ros.Twist)) == (
        type_hash(ros.Twist),
        "",
    )
    assert read_user_data(user_data(ros.Twist, "AGI-2")) == (
        type_hash(ros.Twist),
        "AGI-2",
    )


@pytest.mark.parametrize("data", [b"", b"\0", b"\xff\xfe=;;=", b"typehash", b"a=b;\0"])
def test_user_data_of_others_are_no_hash(data: bytes) -> None:
    assert read_user_data(data) == ("", "")
