"""Twists behind the gate, and neighbours for Nav2 and RViz."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.feedback import Feedback, FeedbackAlert
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.observations import Origin
from iveg.robot.feedback import Authors
from iveg.robot.peer_alerts import Neighbour
from iveg.robot.ros2 import outputs
from iveg.robot.ros2.config import DriveConfig, RobotConfig
from iveg.robot.ros2.outputs import DriveTopics
from iveg.robot.ros2.reading import InputFaults, speed_of
from iveg.ros2 import cdr
from iveg.ros2 import messages as ros
from tests.unit.robot.rig import person as alert
from tests.unit.robot.ros2.said import stamp

# --- drive ------------------------------------------------------------------------

AHEAD = Twist2D(0.5, -0.2)


def topics(**drive: bool) -> tuple[DriveTopics, InputFaults]:
    input_faults = InputFaults()
    found = DriveTopics(RobotConfig(drive=DriveConfig(**drive)), input_faults)
    return found, input_faults


def wished(after: float) -> bytes:
    """What wheels can do of it is ``AHEAD``."""
    twist = ros.Twist(ros.Vector3(0.5, 0.1, 0.2), ros.Vector3(0.3, 0.4, -0.2))
    return cdr.write(ros.TwistStamped(ros.Header(stamp(after), "base_link"), twist))


@pytest.mark.parametrize(
    ("forward", "code"),
    [(math.nan, "not_a_number"), (1e300, "absurd"), (-21.0, "absurd")],
)
def test_a_twist_that_nobody_can_mean_is_a_wish_to_rest(
    forward: float, code: str
) -> None:
    found, input_faults = topics()

    wish = found.read(cdr.write(ros.Twist(ros.Vector3(forward))), 5.0)

    assert wish == REST
    assert speed_of(input_faults.faults(5.0)) == (0.5, code)


def test_an_overtaken_twist_is_dropped_and_a_clock_that_was_set_back_believed() -> None:
    found, input_faults = topics(stamped_in=True)
    read = [
        found.read(wished(stamped), at)
        for at, stamped in enumerate((1.0, 0.9, -3600.0, -3599.9))
    ]

    assert read == [AHEAD, None, AHEAD, AHEAD]
    assert speed_of(input_faults.faults(3.0)) == (0.5, "time_back")


def test_what_the_gate_says_is_written_as_the_base_wants_it() -> None:
    plain, _ = topics()
    stamped, _ = topics(stamped_out=True)
    twist = Twist2D(0.25, -0.5)

    bare = cdr.read(ros.Twist, plain.write(twist, 12.5))
    whole = cdr.read(ros.TwistStamped, stamped.write(twist, 12.5))

    assert (bare.linear.x, bare.angular.z, bare.linear.y) == (0.25, -0.5, 0.0)
    assert whole.twist == bare
    assert (whole.header.stamp.seconds, whole.header.frame_id) == (12.5, "base_link")


# --- neighbours -------------------------------------------------------------------

HERE = Pose2D(1.0, 2.0, math.pi / 2)
STAMP = ros.Time(7, 0)


def told(*alerts: FeedbackAlert, who: str = "AGII", x: float = 9.0) -> Feedback:
    return Feedback(who, Origin("c", 1), None, alerts, Pose2D(x, 2.0, 0.0))


def present(feedback: Feedback) -> list[Neighbour]:
    known = Authors("AGI", 1.0)
    known.apply(feedback.robot_id, feedback, HERE, None, 10.0)
    return known.neighbours(10.0)


def test_nobody_is_a_neighbour_of_himself_but_a_person_at_hand_is_one() -> None:
    own = told(alert(1.2, 2.0, class_="robot", class_id="AGII"), who="AGI", x=1.0)
    named = told(alert(5.0, 5.0, class_="robot", class_id="AGI"))

    assert present(own) == []
    assert [one.name for one in present(named)] == ["AGII"]
    assert [one.kind for one in present(told(alert(1.2, 2.0), who="AGI"))] == ["person"]


def test_a_peer_that_was_taken_away_leaves_although_its_last_pose_is_still_told() -> (
    None
):
    known, moved = Authors("AGI", 1.0), "2026-11-24T08:00:00Z"
    left = replace(told(), pose_stamp="2026-11-24T07:59:59Z")
    for second in range(11, 23):
        again = replace(left, origin=Origin("c", second))
        known.apply("AGII", again, HERE, None, float(second))
        assert bool(known.neighbours(float(second))) == (second <= 21)

    back = replace(left, origin=Origin("c", 23), pose_stamp=moved)
    known.apply("AGII", back, HERE, None, 23.0)

    assert [one.name for one in known.neighbours(23.0)] == ["AGII"]


def test_a_person_becomes_a_disc_in_the_robots_own_frame() -> None:
    """2 m north of a robot that looks north is 2 m ahead."""
    person = Neighbour("person", "farmer", 1.0, 4.0, 0.35, 2.0)

    cloud = outputs.cloud([person], HERE, STAMP, "base_link")
    points = np.frombuffer(cloud.data.tobytes(), "<f4").reshape(-1, 3)
    near = points[np.hypot(*points.T[:2]) < outputs.REACH_M]

    assert cloud.header.frame_id == "base_link"
    assert near[:, 0].mean() == pytest.approx(2.0, abs=0.01)
    assert near[:, 1].mean() == pytest.approx(0.0, abs=0.01)
    assert np.hypot(near[:, 0] - 2.0, near[:, 1]).max() <= 0.351
    assert len(near) > 20


def test_rviz_gets_a_body_a_zone_and_a_name_that_fade() -> None:
    person = Neighbour("person", "farmer", 1.0, 4.0, 0.35, 2.5)

    body, zone, name = outputs.markers([person], STAMP, "map").markers

    assert (body.scale.x, zone.scale.x) == (0.7, 5.0)
    assert (name.text, name.type) == ("farmer", 9)
    assert {one.lifetime.sec for one in (body, zone, name)} == {1}
    assert len({(one.ns, one.id) for one in (body, zone, name)}) == 3
    assert body.header.frame_id == "map"
