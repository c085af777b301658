"""The safety machine, sentence by sentence (docs/safety.md)."""

import math
from itertools import pairwise

import numpy as np
import pytest

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import Hold, LaserScan, Origin
from iveg.robot.holds import HoldSet
from iveg.robot.judgement import Limits
from iveg.robot.safety import ATTEMPTS_KEPT, Report
from tests.unit.robot.rig import AHEAD, REST, STEP_S, Rig, person, release, resume, stop


def moving() -> Rig:
    """A robot at full speed."""
    rig = Rig().drive_on()
    assert rig.twist == AHEAD
    return rig


# --- boot ---------------------------------------------------------------------------


def test_a_robot_boots_held_and_stands_once_it_measures_that_it_does() -> None:
    rig = Rig(odometry=False)
    rig.step()
    assert rig.state == "HELD"
    assert rig.holds == (Hold("boot-b1", "boot", "remote"),)
    rig.odometry = True
    rig.step()
    assert rig.state == "STANDING"


def test_an_unreadable_hold_file_counts_as_a_stop_that_no_crew_can_lift() -> None:
    rig = Rig(disk=None).run(0.2)
    rig.perform(rig.machine.release_locally(rig.now))
    assert [hold.source for hold in rig.holds] == ["iveg"]
    assert rig.state == "STANDING"


def test_a_reboot_keeps_stops_and_local_holds_and_renews_the_boot_hold() -> None:
    held = HoldSet(
        (
            Hold("boot-b0", "boot", "remote"),
            Hold("01STOP", "iveg", "remote"),
            Hold("hw-1", "hw", "local"),
            Hold("link-1", "link", "auto"),
        ),
        ("old",),
    )
    rig = Rig(disk=held)
    assert [hold.id for hold in rig.holds] == ["01STOP", "hw-1", "boot-b1"]
    assert rig.machine.holds.released == ("old",)


def test_a_robot_that_never_heard_iveg_does_not_move() -> None:
    rig = Rig(speaks=False)
    rig.perform(rig.machine.release_locally(rig.now))
    rig.run(0.6)
    rig.wished = AHEAD
    rig.run(2.0)
    assert rig.twist == REST
    assert rig.reason == "watchdog"


def test_a_report_tells_speed_the_age_of_feedback_and_what_holds_it() -> None:
    rig = moving().run(0.5)
    report = rig.reports[-1]
    assert (report.linear, report.angular) == (AHEAD.linear_x, AHEAD.angular_z)
    assert report.feedback_age_s is not None
    assert 0.0 <= report.feedback_age_s < 1.0
    rig.stop("01STOP")
    report = rig.reports[-1]
    assert (report.speed_factor, report.reason, report.cause) == (0.0, "hold", "01STOP")


# --- STOP ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    "payload",
    [
        stop("01STOP"),
        b"STOP",
        b'{"cmd": {"stop": {"id": "x"}}, "cmd": {"resume": {"ch": "x"}}}',
        b'{"cmd": {"\\u0073top": {}}}',
        b"\xff\xfeStOp\x00",
        b"[" * 5000 + b"stop",
    ],
)
def test_whatever_smells_of_a_stop_is_one(payload: bytes) -> None:
    rig = moving()
    answer = rig.command(payload)
    assert answer.result == "LATCHED"
    assert rig.twist == REST
    assert answer.id in {hold.id for hold in answer.holds}


@pytest.mark.parametrize("payload", [b"STOP", b'{"cmd": {"stop": {"id": "a;b"}}}'])
def test_stops_without_a_name_that_can_be_told_share_one_local_hold(
    payload: bytes,
) -> None:
    rig = moving()
    first, second = rig.command(payload), rig.command(payload)
    assert first.id is not None
    assert first.id.startswith("local-")
    assert first.id == second.id
    assert len(rig.holds) == 1


def test_a_stop_that_takes_the_name_of_another_hold_gets_its_own() -> None:
    rig = moving()
    rig.perform(rig.machine.local_hold("hw", rig.now))
    taken = rig.holds[0].id
    rig.stop(taken)
    assert [hold.source for hold in rig.holds] == ["hw", "iveg"]


# --- release and resume -------------------------------------------------------------


@pytest.mark.parametrize(
    "rig", [Rig(speed=Twist2D(0.0, 0.05), obeys=False), Rig(odometry=False)]
)
def test_a_robot_that_moves_or_does_not_know_its_speed_is_not_released(
    rig: Rig,
) -> None:
    answer = rig.run(0.5).release()
    assert (answer.result, answer.why) == ("REFUSED", "not_standing")


def test_a_robot_whose_pose_moves_while_its_wheels_rest_is_not_released() -> None:
    rig = Rig().run(0.5)
    for step in range(40):
        rig.pose = Pose2D(0.3 * step * STEP_S, 0.0, 0.0)
        rig.step()
    answer = rig.release()
    assert (answer.result, answer.why) == ("REFUSED", "not_standing")
    rig.run(1.2)
    assert rig.release().result == "RELEASED"


@pytest.mark.parametrize(
    ("ids", "challenge", "why"),
    [(["01A"], None, "holds_missing"), (["01A", "boot-b1"], "old", "challenge")],
)
def test_a_release_that_does_not_fit_lifts_no_hold(
    ids: list[str], challenge: str | None, why: str
) -> None:
    rig = Rig().run(0.5)
    rig.stop("01A")
    answer = rig.command(release(ids, challenge or rig.machine.challenge))
    assert (answer.result, answer.why) == ("REFUSED", why)
    assert len(rig.holds) == 2


def test_the_answer_to_an_order_names_its_attempt() -> None:
    rig = Rig().run(0.5)
    lifted = rig.command(release(["boot-b1"], rig.machine.challenge, "01TRY"))
    resumed = rig.command(resume(rig.machine.challenge, "01GO"))
    assert (lifted.result, lifted.attempt) == ("RELEASED", "01TRY")
    assert (resumed.result, resumed.attempt) == ("RESUMED", "01GO")
    assert rig.stop("01STOP").attempt is None


def test_an_attempt_that_is_forgotten_cannot_act_either() -> None:
    rig = Rig().run(0.5)
    order = release(["boot-b1"], rig.machine.challenge, "01TRY")
    rig.command(order)
    for number in range(ATTEMPTS_KEPT):
        rig.command(resume("none", f"t{number}"))
    rig.stop("01NEW")
    rig.run(0.5)
    rig.command(order)
    assert [hold.id for hold in rig.holds] == ["01NEW"]


def test_a_release_that_came_too_early_stays_refused_and_has_spent_its_challenge() -> (
    None
):
    rig = Rig(speed=Twist2D(0.0, 0.05), obeys=False).run(0.5)
    challenge = rig.machine.challenge
    order = release(["boot-b1"], challenge, "01TRY")
    first = rig.command(order)
    rig.speed = REST
    rig.run(1.0)
    again = rig.command(order)
    assert (first.why, again.why) == ("not_standing", "not_standing")
    assert again.attempt == "01TRY"
    assert rig.command(release(["boot-b1"], challenge)).why == "challenge"
    assert rig.release().result == "RELEASED"


@pytest.mark.parametrize(
    "payload",
    [
        b'{"cmd": {"release": {"ids": ["boot-b1"], "attempt": "t"}}}',
        b'{"cmd": {"release": {"ids": ["boot-b1"], "ch": "b1n1"}}}',
        b'{"cmd": {"release":'
        b' {"ids": ["boot-b1"], "ch": "b1n1", "attempt": "t", "by": "x"}}}',
        b'{"cmd": {"resume": {}, "release": {}}}',
        b'{"release": {"ids": ["boot-b1"], "ch": "b1n1", "attempt": "t"}}',
    ],
)
def test_a_release_or_resume_that_is_not_perfect_is_refused(payload: bytes) -> None:
    rig = Rig().run(0.2)
    answer = rig.command(payload)
    assert (answer.result, answer.why) == ("REFUSED", "malformed")
    assert len(rig.holds) == 1


def test_the_challenge_changes_every_five_seconds_until_the_robot_runs() -> None:
    rig = Rig().run(0.1)
    first = rig.machine.challenge
    rig.run(5.1)
    second = rig.machine.challenge
    rig.release()
    rig.run(5.1)
    third = rig.machine.challenge
    rig.resume()
    fourth = rig.machine.challenge
    rig.run(11.0)
    assert len({first, second, third, fourth}) == 4
    assert rig.machine.challenge == fourth


# --- local holds --------------------------------------------------------------------


def test_a_pressed_button_is_one_hold_however_often_it_says_so() -> None:
    rig = moving()
    rig.perform(rig.machine.local_hold("hw", rig.now))
    rig.perform(rig.machine.local_hold("hw", rig.now))
    assert len(rig.holds) == 1
    assert rig.twist == REST


# --- the retained desired state -----------------------------------------------------


def test_a_retained_stopped_holds_until_released_and_run_releases_nothing() -> None:
    rig = Rig().run(0.2)
    rig.release()
    rig.level("stopped", "01A", "01B")
    rig.level("run")
    assert [hold.id for hold in rig.holds] == ["01A", "01B"]
    rig.release()
    rig.level("stopped", "01A")
    assert rig.holds == ()


@pytest.mark.parametrize(
    "payload",
    [b'{"desired": "stopped"}', b'{"desired": "stopped", "ids": [7]}', b"Stop"],
)
def test_a_level_that_stops_without_a_name_holds(payload: bytes) -> None:
    rig = moving()
    rig.perform(rig.machine.desired(payload, rig.now))
    assert [hold.source for hold in rig.holds] == ["iveg"]


# --- watchdog -----------------------------------------------------------------------


def _lose_iveg(rig: Rig) -> None:
    """For as long as it takes to be held."""
    rig.speaks = False
    rig.run(4.2)
    rig.speaks = True


@pytest.mark.parametrize("seen", [{}, {"AGII": 501}, {"AGI": 7}, {"AGI": 10**9}])
def test_feedback_that_has_not_seen_us_is_no_sign_of_life(seen: dict[str, int]) -> None:
    rig = moving()
    rig.speaks = False
    for _ in range(20):
        rig.hear(rig.feedback(seen=seen))
        rig.run(0.2)
    assert [hold.source for hold in rig.holds] == ["link"]


def test_a_link_hold_clears_itself_after_two_fresh_seconds_and_ramps() -> None:
    rig = moving()
    _lose_iveg(rig)
    rig.run(1.9)
    assert rig.holds
    rig.run(0.4)
    assert rig.holds == ()
    assert 0.0 < rig.twist.linear_x < 0.3
    rig.run(3.0)
    assert rig.twist == AHEAD


def test_a_link_hold_that_another_hold_joined_waits_for_a_person() -> None:
    rig = moving()
    _lose_iveg(rig)
    rig.stop("01STOP")
    rig.run(5.0)
    assert [hold.ack for hold in rig.holds] == ["remote", "remote"]
    rig.wished = REST
    assert rig.release().result == "RELEASED"
    assert rig.state == "READY"


def test_the_fourth_link_hold_of_a_minute_waits_for_a_person() -> None:
    rig = moving()
    acks = []
    for _ in range(4):
        _lose_iveg(rig)
        acks.append(rig.holds[0].ack)
        rig.run(2.8)
    assert acks == ["auto", "auto", "auto", "remote"]
    rig.run(3.0)
    assert rig.twist == REST


def test_the_policy_slow_stays_at_half_however_long_the_silence() -> None:
    rig = Rig(limits=Limits(slow_s=2.0, on_link_loss="slow")).drive_on()
    rig.speaks = False
    rig.run(1.3)
    assert rig.factor == 1.0, "how long is a setting"
    rig.run(10.0)
    assert rig.holds == ()
    assert rig.twist == Twist2D(0.5, 0.2)


# --- own pose -----------------------------------------------------------------------


def test_an_own_pose_that_grows_old_slows_and_then_halts() -> None:
    rig = moving()
    rig.odometry = False
    rig.run(0.15)
    fresh = rig.factor
    rig.run(0.15)
    late = rig.factor, rig.reason
    rig.run(0.3)
    assert (fresh, late, rig.factor) == (1.0, (0.5, "stale"), 0.0)
    assert rig.twist == REST
    assert rig.holds == ()


def test_odometry_that_is_no_number_is_no_odometry() -> None:
    rig = moving()
    rig.odometry = False
    for _ in range(12):
        rig.run(0.05)
        nan = Pose2D(float("nan"), 0.0, 0.0)
        rig.perform(rig.machine.odometry(nan, REST, rig.now))
    assert rig.factor == 0.0


# --- reports -------------------------------------------------------------------------


def _reported(rig: Rig) -> tuple[int, list[float]]:
    """How many reports there are in 4 s, and when some went through the agent."""
    began = rig.now
    rig.run(4.0)
    said = [(at, one) for at, one in rig.log if at > began and isinstance(one, Report)]
    return len(said), [began, *(at for at, one in said if one.is_measure)]


def test_a_robot_reports_twice_a_second_through_the_agent_and_held_ten_times() -> None:
    rig = moving()
    count, through_agent = _reported(rig)
    assert 8 <= count == len(through_agent) - 1

    rig.stop("01STOP")
    last = next(one for _, one in reversed(rig.log) if isinstance(one, Report))
    assert last.is_measure
    assert last.report.holds[-1].id == "01STOP"
    rig.run(1.0)
    count, through_agent = _reported(rig)
    assert count >= 40
    assert len(through_agent) <= 13
    assert max(b - a for a, b in pairwise(through_agent)) <= 0.5


# --- the laser ----------------------------------------------------------------------


def _sweep(*seen_at: float) -> LaserScan:
    """A full turn in the open in which somebody 0.5 m wide is ahead (m)."""
    ranges = np.full(360, np.inf, np.float32)
    for away in seen_at:
        half = math.degrees(math.atan2(0.25, away))
        ranges[round(180 - half) : round(180 + half)] = away
    step = math.tau / 360
    return LaserScan(
        "AGI", Origin(), -math.pi, step, 0.1, 30.0, Pose2D(0, 0, 0), ranges
    )


def _scanned(rig: Rig, seconds: float, *seen_at: float) -> Rig:
    for _ in range(round(seconds / 0.1)):
        rig.perform(rig.machine.scan(_sweep(*seen_at), rig.now))
        rig.run(0.1)
    return rig


def test_what_the_laser_sees_near_halves_the_speed_and_the_report_says_so() -> None:
    rig = _scanned(moving(), 0.4, 2.0)
    assert rig.twist.linear_x == pytest.approx(0.5)
    assert (rig.machine.cap.factor, rig.machine.cap.reason) == (0.5, "obstacle")
    assert rig.reports[-1].reason == "obstacle"
    _scanned(rig, 1.2)
    assert rig.machine.cap.factor == 0.5, "half a second gone, not yet one more"
    _scanned(rig, 1.0)
    assert rig.machine.cap.factor == 1.0


def test_who_walks_beside_it_is_told_where_and_told_often() -> None:
    rig = moving()
    rig.pose = Pose2D(5.0, 1.0, 0.0)
    rig.run(0.1)
    for step in range(12):
        _scanned(rig, 0.1, 2.4 - 0.08 * step)
    before = len(rig.reports)
    for step in range(5):
        _scanned(rig, 0.1, 1.4 - 0.08 * step)
    told = rig.reports[-1].obstacle
    assert told is not None
    assert (told.x, told.y) == pytest.approx((5.0 + 1.1, 1.0), abs=0.25)
    assert told.width_m == pytest.approx(0.5, abs=0.1)
    assert told.moved
    assert len(rig.reports) - before >= 4, "ten a second, to iVeg alone"


def test_what_stands_beside_it_is_told_without_motion_even_if_a_person_is_graver() -> (
    None
):
    rig = moving()
    rig.alerts = (person(1.0),)
    told = _scanned(rig, 1.2, 2.0).reports[-1]
    assert told.reason == "person"
    assert told.obstacle is not None
    assert not told.obstacle.moved
    assert _scanned(rig, 2.0).reports[-1].obstacle is None
