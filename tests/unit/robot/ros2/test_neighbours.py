"""Costmap injection: who is near, for Nav2's obstacle layer and for RViz."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.feedback import Feedback, FeedbackAlert
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Origin
from iveg.robot.neighbours import Neighbour, Neighbours
from iveg.robot.ros2 import markers, neighbours
from iveg.ros2 import sensor_msgs, std_msgs

HERE = Pose2D(1.0, 2.0, math.pi / 2)
STAMP = std_msgs.Time(7, 0)


def alert(
    x: float, y: float, class_: str = "person", name: str = "farmer"
) -> FeedbackAlert:
    return FeedbackAlert("d", "", class_, name, 0.9, (x, y, 0.9), 2.0, "AGII")


def told(*alerts: FeedbackAlert, who: str = "AGII", x: float = 9.0) -> Feedback:
    return Feedback(who, Origin("c", 1), None, alerts, Pose2D(x, 2.0, 0.0))


def present(*feedback: Feedback, age: float = 0.0) -> list[Neighbour]:
    known = Neighbours("AGI")
    for one in feedback:
        known.note(one.robot_id, one, 10.0)
    return known.present(HERE, 10.0 + age)


def points(cloud: sensor_msgs.PointCloud2) -> np.ndarray:
    return np.frombuffer(cloud.data.tobytes(), "<f4").reshape(-1, 3)


def test_people_and_peers_are_neighbours() -> None:
    found = present(told(alert(3.0, 2.0)))

    assert [(one.kind, one.name, one.x) for one in found] == [
        ("person", "farmer", 3.0),
        ("robot", "AGII", 9.0),
    ]


def test_one_that_two_topics_tell_of_is_there_once() -> None:
    both = told(alert(3.0, 2.0)), told(alert(3.01, 2.0), who="AGIII", x=9.0)

    assert [one.kind for one in present(*both)] == ["person", "robot", "robot"]


def test_nobody_is_a_neighbour_of_himself() -> None:
    own = told(alert(1.2, 2.0, "robot", "AGII"), who="AGI", x=1.0)
    named = told(alert(5.0, 5.0, "robot", "AGI"))

    assert present(own) == []
    assert [one.name for one in present(named)] == ["AGII"]


def test_a_person_within_reach_of_the_hand_is_not_taken_for_oneself() -> None:
    found = present(told(alert(1.2, 2.0), who="AGI"))

    assert [one.kind for one in found] == ["person"]


def test_who_is_told_of_no_more_is_gone() -> None:
    assert present(told(alert(3.0, 2.0)), age=3.1) == []


def test_a_peer_that_was_taken_away_leaves_although_its_last_pose_is_still_told() -> (
    None
):
    known, moved = Neighbours("AGI"), "2026-11-24T08:00:00Z"
    left = replace(told(), pose_stamp="2026-11-24T07:59:59Z")
    known.note("AGII", left, 10.0)
    for second in range(11, 22):
        known.note("AGII", left, float(second))
        assert bool(known.present(HERE, float(second))) == (second <= 20)

    known.note("AGII", replace(left, pose_stamp=moved), 22.0)

    assert [one.name for one in known.present(HERE, 22.0)] == ["AGII"]


def test_a_person_becomes_a_disc_in_the_robots_own_frame() -> None:
    """2 m north of a robot that looks north is 2 m ahead."""
    person = Neighbour("person", "farmer", 1.0, 4.0, 0.35, 2.0)

    cloud = neighbours.cloud([person], HERE, STAMP, "base_link")
    near = points(cloud)[np.hypot(*points(cloud).T[:2]) < neighbours.REACH_M]

    assert cloud.header.frame_id == "base_link"
    assert near[:, 0].mean() == pytest.approx(2.0, abs=0.01)
    assert near[:, 1].mean() == pytest.approx(0.0, abs=0.01)
    assert np.hypot(near[:, 0] - 2.0, near[:, 1]).max() <= 0.351
    assert len(near) > 20


def test_a_cloud_has_far_points_all_round_that_clear_the_layer() -> None:
    cloud = neighbours.cloud([], HERE, STAMP, "base_link")

    x, y, z = points(cloud).T
    angles = np.sort(np.arctan2(y, x))
    assert np.hypot(x, y).min() > neighbours.REACH_M
    assert np.diff(angles).max() * neighbours.REACH_M < 0.05
    assert set(z.tolist()) == {0.5}
    assert cloud.width * cloud.point_step == cloud.row_step == cloud.data.size
    assert [one.offset for one in cloud.fields] == [0, 4, 8]


def test_who_is_out_of_reach_is_left_out_of_the_cloud() -> None:
    far = Neighbour("person", "farmer", 1.0, 20.0, 0.35, 2.0)

    cloud = neighbours.cloud([far], HERE, STAMP, "base_link")

    assert cloud.width == neighbours.cloud([], HERE, STAMP, "base_link").width


def test_rviz_gets_a_body_a_ring_and_a_name_that_fade() -> None:
    person = Neighbour("person", "farmer", 1.0, 4.0, 0.35, 2.5)

    body, ring, name = markers.markers([person], STAMP, "map").markers

    assert (body.scale.x, ring.scale.x) == (0.7, 5.0)
    assert (name.text, name.type) == ("farmer", 9)
    assert {one.lifetime.sec for one in (body, ring, name)} == {1}
    assert len({(one.ns, one.id) for one in (body, ring, name)}) == 3
    assert body.header.frame_id == "map"
