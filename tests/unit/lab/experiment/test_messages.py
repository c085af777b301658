"""Δt₁ and Δt₂ of the same messages, and the share of which nobody knows them."""

import pytest

from iveg.lab.experiment.messages import MessageRecorder, MessageTimes, counts_of
from iveg.ngsi.codec import write_measure
from tests.builders import START, notification, odometry, origin, pose_value


def message(
    seq: int = 0, stamp: float | None = 0.0, broker: float = 0.01, **more: float
) -> MessageTimes:
    return MessageTimes("AGI", "odometry", "b", seq, stamp, broker, **more)


def test_both_parts_of_the_way_are_the_whole_way_of_the_same_message() -> None:
    hops = message(stamp=1.0, broker=1.01, orion=1.05).hops

    assert hops is not None
    assert list(hops) == ["uplink", "fiware", "robot_orion"]
    assert list(hops.values()) == pytest.approx([0.01, 0.04, 0.05])


def test_what_never_came_or_came_first_is_counted_once() -> None:
    times = [
        message(0, orion=0.020),
        message(1, orion=0.021),
        message(2),
        message(3, orion=0.002),
    ]

    assert counts_of(times)["odometry"] == {"sent": 4, "lost": 1, "orion_first": 1}


def test_a_message_of_the_robots_topic_is_found_again_in_orions_copy() -> None:
    recorder = MessageRecorder()
    for seq in (7, 8):
        sent = odometry(origin=origin(seq))
        recorder.take_publication("/iveg/AGI_odom/attrs", write_measure(sent))
    recorder.take_notification(b"no notification")
    recorder.take_notification(
        notification({"base_pose_ground_truth": pose_value(seq=8)})
    )

    lost, came = recorder.times(0.0, float("inf"))

    assert (lost.seq, lost.stamp, lost.orion) == (7, START.wall, None)
    assert (came.seq, came.robot_id, came.data) == (8, "AGI", "odometry")
    assert came.orion is not None
    assert came.orion >= came.broker
    assert recorder.times(0.0, lost.broker) == []
