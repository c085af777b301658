"""Bytes of ROS 2 in and out, and types against published hashes."""

from typing import Any

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

# --- cdr --------------------------------------------------------------------------

IN_MAP = ros.Header(ros.Time(7, 5), "map")
DRIVES = ros.Twist(ros.Vector3(0.5), ros.Vector3(z=1.0))
SCAN = ros.LaserScan(IN_MAP, ranges=np.array([1.0, np.inf], np.float32))
SEEN = ros.Detection3D(IN_MAP, (ros.ObjectHypothesisWithPose(),), id="7")
MESSAGES = [
    DRIVES,
    SCAN,
    ros.Odometry(IN_MAP, "base_link"),
    ros.TFMessage((ros.TransformStamped(IN_MAP, "odom"),)),
    ros.Detection3DArray(IN_MAP, (SEEN,)),
    d.BoundingBoxes(IN_MAP, bounding_boxes=(d.BoundingBox(0.5, class_id="farmer"),)),
    d.DetectionArray(IN_MAP, (d.Detection(class_name="farmer"),)),
]


def test_a_stamped_twist_has_the_bytes_that_ros_gives_it() -> None:
    written = cdr.write(ros.TwistStamped(IN_MAP, DRIVES))

    head = "00010000 07000000 05000000 04000000 6d617000"
    half, one, zero = "000000000000e03f", "000000000000f03f", "0000000000000000"
    assert written == bytes.fromhex(f"{head} {half} {zero * 4} {one}")


@pytest.mark.parametrize("message", MESSAGES, ids=lambda one: one.ROS)
def test_what_is_written_is_read_and_what_breaks_off_is_unreadable(
    message: Any,
) -> None:
    whole = cdr.write(message)
    read = cdr.read(type(message), whole)

    assert type(read) is type(message)
    assert cdr.write(read) == whole
    for size in range(len(whole)):
        with pytest.raises(UnreadableError):
            cdr.read(type(message), whole[:size])


@given(st.sampled_from(MESSAGES), st.binary(max_size=200), st.integers(0, 1))
def test_whatever_bytes_come_are_a_message_or_unreadable(
    message: Any, junk: bytes, order: int
) -> None:
    try:
        read = cdr.read(type(message), bytes((0, order, 0, 0)) + junk)
    except UnreadableError:
        return

    assert isinstance(read, type(message))


def test_more_than_padding_and_a_count_that_no_message_can_hold_are_unreadable() -> (
    None
):
    twist, endless = cdr.write(DRIVES), bytes.fromhex("00010000 ffffff7f")

    assert cdr.read(ros.Twist, twist + bytes(3)) == DRIVES
    with pytest.raises(UnreadableError, match="unreadable"):
        cdr.read(ros.Twist, twist + bytes(4))
    with pytest.raises(UnreadableError, match="unreadable"):
        cdr.read(ros.TFMessage, endless + bytes(64))


def test_a_stamp_keeps_its_nanoseconds() -> None:
    assert ros.Time.from_seconds(1700000000.25) == ros.Time(1700000000, 250_000_000)
    assert ros.Time(3, 500_000_000).seconds == 3.5
    assert ros.Time.from_seconds(-0.25) == ros.Time(-1, 750_000_000)


# --- type hash --------------------------------------------------------------------

PUBLISHED: dict[type[Message], str] = {
    ros.Odometry: "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    ros.Detection3DArray: (
        "793f5eab9595ac1c0da07873cc859db42eae51f0ee76056db8562515d830e018"
    ),
}
"""As nodes of ROS 2 Jazzy announced them on DDS."""


@pytest.mark.parametrize(("message", "digest"), PUBLISHED.items())
def test_a_type_has_the_hash_that_ros_2_announces(
    message: type[Message], digest: str
) -> None:
    assert type_hash(message) == f"RIHS01_{digest}"


def test_user_data_are_read_as_they_are_written_and_those_of_others_are_no_hash() -> (
    None
):
    hashed = type_hash(ros.Twist)

    assert read_user_data(user_data(ros.Twist)) == (hashed, "")
    assert read_user_data(user_data(ros.Twist, "AGI-2")) == (hashed, "AGI-2")
    assert read_user_data(b"\xff\xfe=;;=") == ("", "")
