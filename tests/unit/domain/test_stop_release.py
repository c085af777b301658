"""Releases: who may, what is sent, and how a robot comes to drive again."""

from dataclasses import replace

import pytest

from iveg.domain.errors import CommandRefusedError
from iveg.domain.motion import MotionTrack
from iveg.domain.observations import Hold
from iveg.domain.stop import Changed, Closed
from iveg.domain.transports import DIRECT
from tests.builders import at, odometry, safety_report
from tests.unit.domain.bench import (
    BOOT_HOLD,
    IN_STATE,
    NEXT_CHALLENGE,
    RED_BUTTON,
    Bench,
    levels,
    once,
    releasing,
    sends,
    standing,
)

# --- RELEASING --------------------------------------------------------------------


def test_i2_a_release_is_sent_once_with_the_remote_holds_and_the_challenge() -> None:
    bench = standing(BOOT_HOLD, RED_BUTTON)

    bench.release(bench.ours.id, BOOT_HOLD.id, RED_BUTTON.id)
    effects = bench.log + bench.wait(1.5)

    (sent,) = once(effects)
    assert set(sent.attempt.ids) == {bench.ours.id, BOOT_HOLD.id}
    assert sent.ours == (bench.ours.id,)
    assert sent.attempt.challenge == "0123456789abcdef"
    assert sent.attempt.command.transports == {"direct": "pending", "fiware": "pending"}


@pytest.mark.parametrize("seen", [(), ("id-1",), ("id-1", "boot-b1", "more")])
def test_i2_a_release_of_another_set_than_the_robot_reports_is_refused(
    seen: tuple[str, ...],
) -> None:
    bench = standing(BOOT_HOLD)

    with pytest.raises(CommandRefusedError, match="the holds changed"):
        bench.release(*seen)

    assert bench.state == "STANDING"


@pytest.mark.parametrize(
    ("hold", "linear", "why"),
    [(RED_BUTTON, 0.0, "nothing holds it"), (BOOT_HOLD, 0.3, "it is moving")],
)
def test_i2_a_robot_that_only_local_holds_keep_or_that_moves_is_not_released(
    hold: Hold, linear: float, why: str
) -> None:
    bench = Bench()
    bench.report(hold, linear=linear)

    with pytest.raises(CommandRefusedError, match=why):
        bench.release(hold.id)


def test_i2_a_release_needs_a_challenge() -> None:
    bench = Bench()
    silent = replace(safety_report("AGI", BOOT_HOLD), challenge=None)
    bench.machine.reported(silent, at(0.0), DIRECT.id, "unused")

    with pytest.raises(CommandRefusedError, match="no challenge"):
        bench.release(BOOT_HOLD.id)


def test_i2_a_release_needs_a_fresh_report() -> None:
    bench = standing()
    bench.wait(1.1)

    with pytest.raises(CommandRefusedError, match="not fresh"):
        bench.release(bench.ours.id)


@pytest.mark.parametrize(
    "state", ["REQUESTED", "SENT", "DELIVERED", "UNCONFIRMED", "STALE", "READY"]
)
def test_i2_a_release_is_refused_unless_the_robot_is_known_to_stand(state: str) -> None:
    bench = IN_STATE[state]()
    assert bench.state == state

    with pytest.raises(CommandRefusedError, match=state):
        bench.release("id-1")


def test_the_reported_release_of_our_hold_makes_the_robot_ready_not_its_lack() -> None:
    bench = standing()
    ours = bench.ours.id
    bench.release(ours)
    bench.report()
    assert bench.state == "RELEASING"

    effects = bench.report(released=(ours,))

    assert bench.state == "READY"
    assert levels(effects) == ["run"]
    assert not bench.machine.wants_stop


def test_a_refused_release_leaves_the_robot_standing_and_says_why() -> None:
    bench = releasing()
    bench.answer("REFUSED", why="not_standing", attempt=bench.attempt)

    effects = bench.report(bench.ours, challenge=NEXT_CHALLENGE)

    assert bench.state == "STANDING"
    (changed,) = (one for one in effects if isinstance(one, Changed))
    assert (changed.key, changed.why) == ("refused", "not_standing")


@pytest.mark.parametrize("result", ["RELEASED", "RESUMED", "REFUSED"])
@pytest.mark.parametrize("attempt", ["", "01OTHER"])
def test_an_answer_that_does_not_name_the_attempt_is_none_of_it(
    result: str, attempt: str
) -> None:
    bench = releasing()

    bench.answer(result, attempt=attempt)
    bench.report(bench.ours, challenge=NEXT_CHALLENGE)

    assert bench.state == "RELEASING"
    assert bench.once.times.answered.get(DIRECT.id) is None


def test_an_unconfirmed_release_keeps_the_hold_that_a_later_report_shows() -> None:
    bench = releasing()
    held = bench.ours
    before = bench.machine.stop
    bench.report(held, challenge=NEXT_CHALLENGE)

    effects = bench.wait(2.05)

    assert bench.state == "REQUESTED"
    assert bench.changes()[-1] == "release_unconfirmed"
    assert {one.hold_id for one in sends(effects)} == {held.id}
    assert bench.machine.hold_id == held.id
    assert bench.machine.stop is not before


def test_a_hold_in_doubt_is_replaced_when_the_robot_says_nothing_for_a_second() -> None:
    bench = Bench()
    held = [Hold(f"01HELD{number}", "iveg", "remote") for number in range(3)]
    for _ in range(16):
        bench.report(*held)
        bench.wait(0.1)
    bench.report(*held)
    bench.release(*(hold.id for hold in held))
    bench.press("ben")
    bench.report(*held)

    bench.wait(0.95)
    assert bench.machine.hold_id == held[-1].id
    effects = bench.wait(0.15)

    assert bench.machine.hold_id not in {hold.id for hold in held}
    assert {one.hold_id for one in sends(effects)} >= {bench.machine.hold_id}


def test_i7_a_release_without_the_robots_word_becomes_a_stop_under_a_new_id() -> None:
    bench = standing()
    old = bench.ours.id
    bench.release(old)

    bench.wait(1.95)
    assert bench.state == "RELEASING"
    effects = bench.wait(0.1)

    assert bench.state == "REQUESTED"
    assert bench.machine.wants_stop
    assert bench.ours.id != old
    assert len(sends(effects, "direct")) == 1
    ended = [one for one in effects if isinstance(one, Closed)]
    states = {one.command.kind: one.command.state for one in ended}
    assert states == {"release": "EXPIRED", "stop": "REPLACED"}
    assert {one.key for one in ended} == {"release_unconfirmed"}


def test_a_held_robot_that_iveg_did_not_stop_can_be_released() -> None:
    bench = Bench()
    bench.report(BOOT_HOLD)

    bench.release(BOOT_HOLD.id)
    bench.report(released=(BOOT_HOLD.id,))

    assert bench.state == "READY"


# --- READY, RUNNING ---------------------------------------------------------------


def test_a_resume_is_done_when_the_robot_reports_that_it_may_drive() -> None:
    bench = Bench().ready()
    bench.resume()

    bench.report(factor=0.0)
    assert bench.state == "RELEASING"
    bench.report(factor=0.5)

    assert bench.state == "RUNNING"


def test_a_held_robot_cannot_be_resumed() -> None:
    bench = Bench().ready()
    bench.report(RED_BUTTON)

    with pytest.raises(CommandRefusedError, match="still held"):
        bench.resume()


@pytest.mark.parametrize("state", ["RUNNING", "READY"])
def test_a_hold_of_iveg_that_nobody_here_asked_for_is_adopted_until_it_is_released(
    state: str,
) -> None:
    bench = IN_STATE[state]()
    found = Hold("01OTHER", "iveg", "remote")

    effects = bench.report(found)

    assert bench.state == "DELIVERED"
    assert bench.machine.hold_id == found.id
    assert levels(effects) == ["stopped"]
    assert not once(effects)
    bench.stand()

    effects = bench.report(released=(found.id,))

    assert bench.state == "READY"
    assert levels(effects) == ["run"]
    assert not sends(effects)


def test_i2_a_release_is_refused_while_another_stop_cannot_have_been_seen() -> None:
    bench = standing()
    bench.press("ben")

    with pytest.raises(CommandRefusedError, match="just now"):
        bench.release(bench.ours.id)

    # A release that was begun just before takes two seconds to hold, and its way.
    for _ in range(25):
        bench.report(bench.ours)
        bench.wait(0.1)
    with pytest.raises(CommandRefusedError, match="just now"):
        bench.release(bench.ours.id)
    for _ in range(5):
        bench.report(bench.ours)
        bench.wait(0.1)
    bench.release(bench.ours.id)
    assert bench.state == "RELEASING"


def test_i2_a_robot_whose_pose_moves_is_not_released_though_it_reports_rest() -> None:
    bench, track = Bench(), MotionTrack()
    bench.press()
    bench.stand()
    moved = bench.ours
    for number in range(5):
        bench.report(moved)
        said = odometry(x=0.06 * number, linear=0.0)
        motion = track.note_odometry(said.pose, said.twist, bench.now)
        bench.machine.evidence.standstill.odometry(said, motion, at(bench.now))
        bench.wait(0.1)
    bench.report(moved)

    with pytest.raises(CommandRefusedError, match="it is moving"):
        bench.release(moved.id)
