"""What a robot keeps of feedback, and for how long (docs/safety.md, Algorithm 3)."""

import pytest

from iveg.domain.feedback import (
    CLEAR,
    UNSUPERVISED,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import Origin
from iveg.robot.caps import FREE, Cap, lowest
from iveg.robot.peer_feedback import PeerFeedback
from tests.unit.robot.rig import person

HERE = Pose2D(0.0, 0.0, 0.0)


class Bench:
    """One robot's peer feedback; messages of topic AGII count up by themselves."""

    def __init__(self) -> None:
        self.peer_feedback = PeerFeedback("AGI")
        self.seq = 0

    def tell(
        self,
        at: float,
        *alerts: FeedbackAlert,
        alert: FeedbackAlert | None = None,
        speed_limit: SpeedLimit | None = CLEAR,
        own: Pose2D | None = HERE,
        pose: Pose2D | None = None,
        twist: Twist2D | None = None,
        pose_stamp: str | None = None,
        robot_id: str = "AGII",
        origin: Origin | None = None,
    ) -> bool:
        self.seq += 1
        feedback = Feedback(
            robot_id,
            origin or Origin("cloud", self.seq),
            alert,
            alerts,
            pose,
            twist,
            pose_stamp,
            {} if speed_limit is None else {"AGI": speed_limit},
        )
        return self.peer_feedback.apply(robot_id, feedback, own, at)

    def cap(self, at: float, own: Pose2D | None = HERE, slowed: bool = False) -> Cap:
        return lowest(self.peer_feedback.caps(own, slowed, at))


@pytest.mark.parametrize(("distance", "factor"), [(2.0, 0.5), (2.0001, 1.0)])
def test_the_ring_is_inclusive(distance: float, factor: float) -> None:
    bench = Bench()
    bench.tell(0.0, person(distance))
    assert bench.cap(0.0).factor == factor


def test_the_ring_is_as_wide_as_told() -> None:
    bench = Bench()
    bench.tell(0.0, person(4.0, radius_m=4.5))
    assert bench.cap(0.0).reason == "person"


def test_a_robot_alert_slows_for_a_robot() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.5, class_="robot"))
    assert bench.cap(0.0) == Cap(0.5, "robot", None, "d-1")


def test_the_newest_alert_counts_when_the_list_is_empty() -> None:
    bench = Bench()
    bench.tell(0.0, alert=person(1.0))
    assert bench.cap(0.0).factor == 0.5


def test_a_confident_object_of_another_class_slows_nobody() -> None:
    bench = Bench()
    bench.tell(0.0, alert=FeedbackAlert("", "2026-11-20T10:00:00.000Z"))
    assert bench.cap(0.0) == FREE


def test_a_ring_lets_go_later_than_it_catches() -> None:
    bench = Bench()
    bench.tell(0.0, person(2.25))
    assert bench.cap(0.0).factor == 1.0
    assert bench.cap(0.0, slowed=True).factor == 0.5


def test_a_person_without_position_is_where_the_observer_is() -> None:
    bench = Bench()
    nowhere = FeedbackAlert("d-1", "", "person", observer="AGII")
    bench.tell(0.0, nowhere, pose=Pose2D(9.0, 0.0, 0.0))
    assert bench.cap(0.0).factor == 1.0
    assert bench.cap(0.0, Pose2D(8.0, 0.0, 0.0)).reason == "person"


def test_a_person_without_any_position_is_near() -> None:
    bench = Bench()
    bench.tell(0.0, FeedbackAlert("d-1", "", "person"))
    assert bench.cap(0.0).factor == 0.5


def test_a_person_missing_from_a_message_stays_until_the_topic_has_moved_on() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.0))
    for at in (0.2, 0.4, 0.6, 0.8, 1.0, 1.1):
        bench.tell(at)
        assert bench.cap(at).factor == 0.5
    bench.tell(1.25)
    assert bench.cap(1.25) == FREE


def test_a_person_who_is_told_again_in_between_stays() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.0))
    bench.tell(0.8)
    bench.tell(1.0, person(1.0))
    bench.tell(1.2)
    bench.tell(2.1)
    assert bench.cap(2.1).factor == 0.5


def test_one_message_after_a_long_silence_does_not_make_a_person_vanish() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.0))
    bench.tell(5.0)
    assert bench.cap(5.0).factor == 0.5


def test_a_person_of_a_silent_topic_stays_ten_seconds() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.0))
    assert bench.cap(9.9).factor == 0.5
    assert bench.cap(10.1) == FREE


def test_the_ring_of_a_silent_topic_grows_up_to_six_metres() -> None:
    bench = Bench()
    bench.tell(0.0, person(5.9))
    assert bench.cap(0.3) == FREE
    assert bench.cap(2.9).factor == 0.5
    bench.tell(3.0, person(6.2))
    assert bench.cap(9.0) == FREE


def test_a_person_who_walks_leaves_no_ring_behind() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.0))
    bench.tell(0.2, person(3.0))
    assert bench.cap(0.2) == FREE


def test_two_sightings_of_one_person_are_two_rings() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.0), person(9.0))
    assert bench.cap(0.0).factor == 0.5


def test_a_speed_limit_lasts_while_its_topic_is_silent_and_no_longer_than_ten() -> None:
    bench = Bench()
    bench.tell(0.0, speed_limit=SpeedLimit(0.5, "stale"))
    assert bench.cap(9.9) == Cap(0.5, "stale")
    assert bench.cap(10.1) == FREE


def test_a_speed_limit_with_an_unheard_of_reason_is_told_as_stale() -> None:
    bench = Bench()
    bench.tell(0.0, speed_limit=SpeedLimit(0.5, "fog"))
    assert bench.cap(0.0).reason == "stale"


# --- order --------------------------------------------------------------------------


def test_an_older_or_equal_message_of_a_topic_is_dropped() -> None:
    bench = Bench()
    assert bench.tell(0.0, person(1.0), origin=Origin("a", 7))
    assert not bench.tell(0.1, origin=Origin("a", 7))
    assert not bench.tell(0.1, origin=Origin("a", 6))
    assert bench.tell(0.2, origin=Origin("a", 8))


def test_a_new_boot_counts_and_an_old_one_does_not_come_back() -> None:
    bench = Bench()
    assert bench.tell(0.0, origin=Origin("a", 900))
    assert bench.tell(0.1, origin=Origin("b", 1))
    assert not bench.tell(0.2, origin=Origin("a", 901))
    assert bench.tell(0.3, origin=Origin("b", 2))


def test_a_message_without_origin_counts_by_arrival() -> None:
    bench = Bench()
    assert bench.tell(0.0, origin=Origin())
    assert bench.tell(0.1, person(1.0), origin=Origin())


def test_the_same_order_in_another_topic_is_news() -> None:
    bench = Bench()
    assert bench.tell(0.0, origin=Origin("a", 1))
    assert bench.tell(0.0, origin=Origin("a", 1), robot_id="AGIII")


def test_a_flood_of_topics_does_not_grow_without_end() -> None:
    bench = Bench()
    for number in range(500):
        bench.tell(
            float(number) / 1000, robot_id=f"R{number}", speed_limit=SpeedLimit(0.5)
        )
    assert len(list(bench.peer_feedback.caps(HERE, False, 0.5))) <= 64


# --- about myself -------------------------------------------------------------------


def test_an_alert_about_myself_does_not_slow_me() -> None:
    bench = Bench()
    bench.tell(0.0, person(0.9, class_="robot"))
    assert bench.cap(0.0) == FREE


def test_where_i_was_seen_stays_about_me_while_i_drive_on() -> None:
    bench = Bench()
    seen = person(0.9, class_="robot")
    bench.tell(0.0, seen)
    away = Pose2D(-0.9, 0.0, 0.0)
    bench.tell(0.2, seen, own=away)
    assert bench.cap(0.2, away) == FREE


def test_a_person_within_a_metre_is_never_me() -> None:
    bench = Bench()
    bench.tell(0.0, person(0.5))
    assert bench.cap(0.0).reason == "person"


def test_a_robot_that_i_see_myself_is_never_me() -> None:
    bench = Bench()
    bench.tell(0.0, person(0.9, class_="robot", observer="AGI"))
    assert bench.cap(0.0).reason == "robot"


def test_a_robot_alert_that_names_me_is_about_me() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.8, class_="robot", class_id="AGI"))
    assert bench.cap(0.0) == FREE


def test_a_robot_alert_that_my_speed_limit_lets_pass_is_about_me() -> None:
    bench = Bench()
    bench.tell(
        0.0,
        person(1.8, class_="robot"),
        speed_limit=SpeedLimit(1.0, "clear", decision_id="d-1"),
    )
    assert bench.cap(0.0) == FREE


def test_a_robot_alert_at_a_lost_own_pose_is_not_taken_for_me() -> None:
    bench = Bench()
    bench.tell(0.0, person(0.5, class_="robot"), own=None)
    assert bench.cap(0.0).reason == "robot"


# --- peers --------------------------------------------------------------------------

DRIVES = Twist2D(0.5, 0.0)


def test_a_moving_peer_within_two_metres_slows() -> None:
    bench = Bench()
    bench.tell(0.0, pose=Pose2D(2.0, 0.0, 0.0), twist=DRIVES)
    assert bench.cap(0.0) == Cap(0.5, "robot", "AGII")
    assert bench.cap(0.0, Pose2D(-0.1, 0.0, 0.0)) == FREE


def test_a_peer_that_stands_slows_nobody_until_its_pose_is_old() -> None:
    bench = Bench()
    for number in range(8):
        bench.tell(
            0.2 * number,
            pose=Pose2D(1.0, 0.0, 0.0),
            twist=Twist2D(0.0, 0.0),
            pose_stamp="same",
        )
    assert bench.cap(0.9) == FREE
    assert bench.cap(1.5).reason == "robot"


def test_a_pose_that_is_repeated_for_ten_seconds_is_forgotten() -> None:
    bench = Bench()
    for number in range(60):
        bench.tell(
            0.2 * number, pose=Pose2D(1.0, 0.0, 0.0), twist=DRIVES, pose_stamp="same"
        )
    assert bench.cap(9.9).reason == "robot"
    assert bench.cap(11.8) == FREE


def test_my_own_pose_in_my_own_topic_does_not_slow_me() -> None:
    bench = Bench()
    bench.tell(0.0, robot_id="AGI", pose=HERE, twist=DRIVES)
    assert bench.cap(0.0) == FREE


def test_whom_a_feedback_does_not_name_is_unsupervised_and_no_more_than_half() -> None:
    bench = Bench()
    bench.tell(0.0, speed_limit=None)
    assert bench.cap(0.0) == Cap(0.5, UNSUPERVISED.reason)


def test_one_topic_that_does_not_name_a_robot_outweighs_one_that_does() -> None:
    bench = Bench()
    bench.tell(0.0, speed_limit=None)
    bench.tell(0.0, robot_id="AGIII")
    assert bench.cap(0.0).factor == 0.5
