"""Feedback on the robot: its age, what it says of others, and who said it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import pytest

from iveg.domain.feedback import (
    CLEAR,
    UNSUPERVISED,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import FeedbackRef, Origin
from iveg.domain.parameters import Class
from iveg.robot.feedback import MOST_AUTHORS, Authors, PeerFeedback, Watchdog
from iveg.robot.gate import FREE, Cap, lowest
from tests.unit.robot.rig import REST, person

# --- watchdog ---------------------------------------------------------------------


def test_a_repeated_number_does_not_make_it_younger_nor_an_older_one_older() -> None:
    watchdog = Watchdog(0.0, 1.0)
    watchdog.sent(7, 10.0)
    watchdog.sent(8, 10.5)
    watchdog.received(8, 10.6)
    watchdog.received(8, 12.0)
    watchdog.received(7, 12.1)
    assert watchdog.age(12.5) == 2.0


# --- peer feedback ----------------------------------------------------------------

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
        speed_limit: SpeedLimit | None = CLEAR,
        own: Pose2D | None = HERE,
        topic: str = "AGII",
        radii: Mapping[Class, float] | None = None,
        **parts: Any,
    ) -> None:
        self.seq += 1
        feedback = Feedback(
            topic,
            Origin("cloud", self.seq),
            alerts=alerts,
            speed_limits={} if speed_limit is None else {"AGI": speed_limit},
            rule={} if radii is None else {"radius_m": radii},
            **parts,
        )
        self.peer_feedback.apply(topic, feedback, own, at)

    def cap(self, at: float, own: Pose2D | None = HERE, slowed: bool = False) -> Cap:
        return lowest(self.peer_feedback.caps(own, slowed, at))


@pytest.mark.parametrize(("distance", "factor"), [(2.0, 0.5), (2.0001, 1.0)])
def test_the_ring_is_inclusive(distance: float, factor: float) -> None:
    bench = Bench()
    bench.tell(0.0, person(distance))
    assert bench.cap(0.0).factor == factor


def test_the_newest_alert_counts_when_the_list_is_empty() -> None:
    bench = Bench()
    bench.tell(0.0, alert=person(1.0))
    assert bench.cap(0.0).factor == 0.5


def test_a_person_without_position_is_where_the_observer_is() -> None:
    bench = Bench()
    nowhere = FeedbackAlert("d-1", "", "person", observer="AGII")
    bench.tell(0.0, nowhere, pose=Pose2D(9.0, 0.0, 0.0))
    assert bench.cap(0.0).factor == 1.0
    assert bench.cap(0.0, Pose2D(8.0, 0.0, 0.0)).reason == "person"


def test_a_person_missing_from_a_message_stays_until_the_topic_has_moved_on() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.0))
    for at in (0.2, 0.4, 0.6, 0.8, 1.0, 1.1):
        bench.tell(at)
        assert bench.cap(at).factor == 0.5
    bench.tell(1.25)
    assert bench.cap(1.25) == FREE


def test_a_person_of_a_silent_topic_stays_ten_seconds_and_the_next_message() -> None:
    bench = Bench()
    bench.tell(0.0, person(1.0))
    assert bench.cap(9.9).factor == 0.5
    assert bench.cap(10.1) == FREE
    bench.tell(20.0, person(1.0))
    bench.tell(25.0)
    assert bench.cap(25.0).factor == 0.5


def test_the_ring_of_a_silent_topic_grows_up_to_six_metres() -> None:
    bench = Bench()
    bench.tell(0.0, person(5.9))
    assert bench.cap(0.3) == FREE
    assert bench.cap(2.9).factor == 0.5
    bench.tell(3.0, person(6.2))
    assert bench.cap(9.0) == FREE


def test_a_speed_limit_lasts_while_its_topic_is_silent_and_no_longer_than_ten() -> None:
    bench = Bench()
    bench.tell(0.0, speed_limit=SpeedLimit(0.5, "stale"))
    assert bench.cap(9.9) == Cap(0.5, "stale")
    assert bench.cap(10.1) == FREE


def test_a_flood_of_topics_does_not_grow_without_end() -> None:
    bench = Bench()
    for number in range(500):
        bench.tell(number / 1000, topic=f"R{number}", speed_limit=SpeedLimit(0.5))
    assert len(list(bench.peer_feedback.caps(HERE, False, 0.5))) <= 64


# --- about myself -------------------------------------------------------------------


ME = person(0.9, class_="robot")
PASSES = SpeedLimit(1.0, "clear", decision_id="d-1")


@pytest.mark.parametrize(
    ("alert", "limit", "own", "reason"),
    [
        (ME, CLEAR, HERE, "clear"),
        (replace(ME, class_id="AGI", position=(1.8, 0.0, 0.9)), CLEAR, HERE, "clear"),
        (replace(ME, position=(1.8, 0.0, 0.9)), PASSES, HERE, "clear"),
        (replace(ME, observer="AGI"), CLEAR, HERE, "robot"),
        (ME, CLEAR, None, "robot"),
        (person(0.5), CLEAR, HERE, "person"),
    ],
    ids=["where I am", "by name", "let pass", "seen by me", "no pose", "a person"],
)
def test_an_alert_about_myself_slows_nobody_and_every_other_does(
    alert: FeedbackAlert, limit: SpeedLimit, own: Pose2D | None, reason: str
) -> None:
    bench = Bench()
    bench.tell(0.0, alert, speed_limit=limit, own=own)
    assert bench.cap(0.0).reason == reason


# --- peers --------------------------------------------------------------------------

NEAR, DRIVES = Pose2D(1.0, 0.0, 0.0), Twist2D(0.5, 0.0)


def test_a_moving_peer_within_two_metres_slows() -> None:
    bench = Bench()
    bench.tell(0.0, pose=Pose2D(2.0, 0.0, 0.0), twist=DRIVES)
    assert bench.cap(0.0) == Cap(0.5, "robot", "AGII")
    assert bench.cap(0.0, Pose2D(-0.1, 0.0, 0.0)) == FREE


def test_a_peer_that_stands_slows_nobody_until_its_pose_is_old() -> None:
    bench = Bench()
    for number in range(8):
        bench.tell(0.2 * number, pose=NEAR, twist=REST, pose_stamp="same")
    assert bench.cap(0.9) == FREE
    assert bench.cap(1.5).reason == "robot"


def test_a_peer_whose_pose_goes_on_does_not_stand_whatever_its_twist_says() -> None:
    bench = Bench()
    for number in range(8):
        place, stamp = Pose2D(1.0 - 0.06 * number, 0.0, 0.0), f"stamp-{number}"
        bench.tell(0.2 * number, pose=place, twist=REST, pose_stamp=stamp)
    assert bench.cap(1.5).reason == "robot"


def test_a_pose_that_is_repeated_for_ten_seconds_is_forgotten() -> None:
    bench = Bench()
    for number in range(60):
        bench.tell(0.2 * number, pose=NEAR, twist=DRIVES, pose_stamp="same")
    assert bench.cap(9.9).reason == "robot"
    assert bench.cap(11.8) == FREE


def test_whom_a_feedback_does_not_name_is_unsupervised_and_no_more_than_half() -> None:
    bench = Bench()
    bench.tell(0.0, speed_limit=None)
    assert bench.cap(0.0) == Cap(0.5, UNSUPERVISED.reason)


# --- radii of the rule ----------------------------------------------------------------


def test_a_peer_slows_within_the_largest_radius_told_in_the_last_ten_seconds() -> None:
    bench = Bench()

    def told(at: float, robots: float) -> float:
        pose = Pose2D(2.8, 0.01 * at, 0.0)
        radii: Mapping[Class, float] = {"person": 2.0, "robot": robots}
        bench.tell(at, pose=pose, twist=DRIVES, radii=radii)
        return bench.cap(at).factor

    assert [told(0.0, 3.0), told(1.0, 1.5), told(10.0, 2.0)] == [0.5] * 3
    assert [told(10.1, 1.5), told(20.1, 1.0)] == [1.0, 1.0]


def test_an_alert_s_zone_is_the_largest_of_the_last_ten_seconds() -> None:
    bench = Bench()
    bench.tell(0.0, radii={"person": 3.0, "robot": 3.0})
    bench.tell(1.0, person(2.8), radii={"person": 2.0, "robot": 2.0})
    assert bench.cap(1.0).factor == 0.5
    bench.tell(11.0, person(2.8), radii={"person": 2.0, "robot": 2.0})
    assert bench.cap(11.0).factor == 1.0


# --- authors ----------------------------------------------------------------------

SLOW = SpeedLimit(0.5, "stale")


@dataclass
class AuthorsBench:
    """One robot, and iVegs that say something to it; ``iveg`` counts by itself."""

    authors: Authors = field(default_factory=lambda: Authors("AGI", 1.0))
    seq: int = 100

    def tell(
        self,
        at: float,
        *,
        origin: Origin | None = None,
        limit: SpeedLimit = CLEAR,
        topic: str = "AGII",
        **parts: Any,
    ) -> bool:
        """One message; it has seen our report of that very moment."""
        self.seq += origin is None
        named = origin or Origin("iveg", self.seq)
        said = Feedback(topic, named, speed_limits={"AGI": limit}, **parts)
        return self.authors.apply(topic, said, HERE, at, at)

    def go_on(self, start: float, end: float, limit: SpeedLimit = CLEAR) -> None:
        """Five messages a second of iVeg."""
        for step in range(round(5 * (end - start)) + 1):
            self.tell(start + 0.2 * step, limit=limit)

    def factor(self, at: float) -> float:
        return lowest(self.authors.caps(HERE, False, at)).factor


def test_a_copy_is_no_news() -> None:
    bench = AuthorsBench()
    bench.go_on(0.0, 1.0)
    assert not bench.tell(1.1, origin=Origin("iveg", bench.seq))
    assert not bench.tell(1.1, origin=Origin("iveg", bench.seq - 3))
    assert bench.factor(1.1) == 1.0


def test_the_same_count_with_another_content_is_another_author() -> None:
    bench = AuthorsBench()
    bench.go_on(0.0, 1.0, SLOW)
    assert bench.tell(1.1, origin=Origin("iveg", bench.seq), limit=CLEAR)
    assert len(bench.authors.echoes(1.1)) == 2
    assert bench.factor(1.1) == 0.5


def test_topics_of_an_author_are_in_no_order_among_each_other() -> None:
    bench = AuthorsBench()
    bench.tell(0.0, origin=Origin("iveg", 12), topic="AGI")
    bench.tell(0.0, origin=Origin("iveg", 11))
    assert bench.authors.echoes(0.0) == (FeedbackRef("iveg", 12),)


# --- too many -----------------------------------------------------------------------


def test_more_than_four_authors_are_half_speed_until_ten_seconds_after_them() -> None:
    bench = AuthorsBench()
    for number in range(MOST_AUTHORS + 1):
        bench.tell(0.0, origin=Origin(f"b{number}", 1))
    for step in range(1, 51):
        for number in range(MOST_AUTHORS):
            bench.tell(0.2 * step, origin=Origin(f"b{number}", 1 + step))
        assert bench.factor(0.2 * step) == 0.5
    for number in range(MOST_AUTHORS):
        bench.tell(10.2, origin=Origin(f"b{number}", 99))
    assert bench.factor(10.2) == 1.0


def test_a_boot_that_changes_each_time_fills_no_memory_and_shuts_nobody_out() -> None:
    bench = AuthorsBench()
    for step in range(200):
        assert bench.tell(0.05 * step, origin=Origin(f"b{step}", 1))
        assert len(bench.authors.echoes(0.05 * step)) <= MOST_AUTHORS
    bench.go_on(10.0, 13.0)
    assert "iveg" in {one.boot for one in bench.authors.echoes(13.0)}
    assert bench.factor(13.0) == 0.5


# --- what is echoed -----------------------------------------------------------------


def test_the_author_met_first_is_echoed_first_and_the_last_however_long_ago() -> None:
    bench = AuthorsBench()
    bench.tell(0.0)
    for step in range(1, 50):
        bench.tell(0.2 * step, origin=Origin("next", step))
    first, second = FeedbackRef("iveg", 101), FeedbackRef("next", 49)
    assert bench.authors.echoes(9.8) == (first, second)
    assert bench.authors.echoes(9.7) == (first, FeedbackRef("next", 48))
    assert bench.authors.echoes(-0.1) == ()
    bench.tell(10.2, origin=Origin("next", 50))
    for now in (10.2, 99.0):
        assert bench.authors.echoes(now) == (FeedbackRef("next", 50),)


@pytest.mark.parametrize(
    "nameless",
    [Origin(), Origin("a"), Origin(None, 3), Origin("", 3), Origin("a;b", 3)],
)
def test_feedback_without_a_name_is_none(nameless: Origin) -> None:
    bench = AuthorsBench()
    bench.tell(0.0)
    assert not bench.tell(0.1, origin=nameless)
    assert len(bench.authors.echoes(0.1)) == 1


# --- the rest -----------------------------------------------------------------------


def test_the_largest_backlog_of_all_authors_counts() -> None:
    bench = AuthorsBench()
    assert bench.authors.backlog_s() is None
    bench.tell(0.0, backlog_s=2.0, origin=Origin("other", 1))
    bench.tell(0.1, backlog_s=0.1)
    bench.tell(0.2, origin=Origin("third", 1))
    assert bench.authors.backlog_s() == 2.0


def test_peers_explain_what_the_laser_sees_only_while_one_author_speaks() -> None:
    bench = AuthorsBench()
    bench.tell(0.0, pose=Pose2D(3.0, 0.0, 0.0), twist=DRIVES)
    assert [one.pose for one in bench.authors.peers(0.0)] == [Pose2D(3.0, 0.0, 0.0)]
    bench.tell(0.1, origin=Origin("stray", 1))
    assert list(bench.authors.peers(0.1)) == []
