"""Every row of the state table of docs/safety.md but the releases'."""

from typing import get_args

import pytest

from iveg.domain.stop import STEPS, Key, OffTable, SendStop, State, StopMachine
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from tests.builders import at
from tests.unit.domain.bench import RED_BUTTON, Bench, levels, pressed, sends, standing

# --- REQUESTED, SENT --------------------------------------------------------------


def test_a_press_asks_for_stop_on_both_transports_and_sets_the_level() -> None:
    bench = Bench()

    effects = bench.press()

    assert bench.state == "REQUESTED"
    assert [type(one) for one in effects[:2]] == [SendStop, SendStop]
    assert [one.transport for one in sends(effects)] == ["direct", "fiware"]
    assert levels(effects) == ["stopped"]
    assert {one.hold_id for one in sends(effects)} == {bench.machine.hold_id}


@pytest.mark.parametrize("transport", ["direct", "fiware"])
def test_a_transport_that_took_it_makes_it_sent_and_the_robots_answer_delivered(
    transport: TransportId,
) -> None:
    bench = pressed()
    bench.sent(transport)
    assert bench.state == "SENT"

    bench.answer(transport=transport)

    assert bench.state == "DELIVERED"


def test_direct_sends_come_at_0_250_500_1000_ms_and_then_every_half_second() -> None:
    bench = Bench()
    effects = {0.0: bench.press()}
    while bench.now < 3.0:
        bench.now = round(bench.now + 0.05, 6)
        effects[bench.now] = bench.tick()

    times = [time for time, done in effects.items() if sends(done, "direct")]

    assert times == [0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]


def test_a_robot_that_has_the_stop_is_sent_it_once_a_second_until_it_stands() -> None:
    bench = pressed()
    bench.sent(FIWARE.id)
    bench.now = 0.05
    bench.report(bench.ours, linear=0.8)
    times = []
    while bench.now < 4.0:
        bench.now = round(bench.now + 0.05, 6)
        times += [(bench.now, one.transport) for one in sends(bench.tick())]

    assert times == [(1.0, "direct"), (2.0, "direct"), (3.0, "direct"), (4.0, "direct")]
    assert bench.stop.tries == 5


def test_the_next_fiware_request_leaves_two_seconds_after_the_last_came_back() -> None:
    bench = pressed()
    bench.wait(0.1)
    bench.sent(FIWARE.id, ok=False)

    early, later = bench.wait(1.9), bench.wait(0.15)

    assert not sends(early, "fiware")
    assert len(sends(later, "fiware")) == 1


# --- DELIVERED, UNCONFIRMED, STILL_MOVING ----------------------------------------


@pytest.mark.parametrize(
    ("result", "hold_id"),
    [("RELEASED", None), ("RESUMED", None), ("REFUSED", None), ("LATCHED", "other")],
)
def test_only_latched_of_our_id_means_delivered(
    result: str, hold_id: str | None
) -> None:
    bench = pressed()

    bench.answer(result, id=hold_id)

    assert bench.state == "REQUESTED"


def test_the_first_times_of_each_transport_are_kept() -> None:
    bench = pressed()
    bench.sent(DIRECT.id)
    bench.now = 0.02
    bench.answer(seq=1)
    bench.now = 0.08
    bench.answer(seq=1, transport=FIWARE.id)
    for transport in (DIRECT.id, FIWARE.id):
        bench.sent(transport)

    assert bench.stop.transports == {DIRECT.id: "ok", FIWARE.id: "ok"}
    assert bench.stop.times.sent[DIRECT.id] == at(0.0)
    assert bench.stop.times.answered[DIRECT.id] == at(0.02)
    assert bench.stop.times.answered[FIWARE.id] == at(0.08)


@pytest.mark.parametrize("first", ["REQUESTED", "SENT"])
def test_no_word_of_the_robot_for_a_second_means_unconfirmed(first: str) -> None:
    bench = pressed()
    for _ in range(first == "SENT"):
        bench.sent(DIRECT.id)
    assert bench.state == first

    bench.wait(0.95)
    assert bench.state == first
    bench.wait(0.05)

    assert bench.state == "UNCONFIRMED"


@pytest.mark.parametrize(
    ("speed", "limit"), [(0.0, 1.5), (0.5, 2.5), (1.0, 3.5), (9.0, 5.0)]
)
def test_f40_delivered_and_not_standing_after_its_braking_time_is_still_moving(
    speed: float, limit: float
) -> None:
    bench = pressed()
    bench.report(bench.ours, linear=speed)

    bench.wait(limit - 0.05)
    assert bench.state == "DELIVERED"
    bench.wait(0.1)

    assert bench.state == "STILL_MOVING"


# --- STANDING ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("samples", "gap", "sparse", "state"),
    [
        (10, 0.1, False, "DELIVERED"),
        (11, 0.1, False, "STANDING"),
        (4, 0.45, False, "DELIVERED"),
        (5, 0.45, False, "STANDING"),
        (5, 0.6, False, "DELIVERED"),
        (5, 0.6, True, "STANDING"),
        (5, 0.8, True, "DELIVERED"),
    ],
)
def test_standing_needs_five_samples_over_a_second_without_a_gap_of_their_topic(
    samples: int, gap: float, sparse: bool, state: str
) -> None:
    bench = pressed()
    for number in range(samples):
        bench.now = round(gap * number, 6)
        bench.report(bench.ours, sparse=sparse)

    assert bench.state == state


@pytest.mark.parametrize(("linear", "angular"), [(0.02, 0.0), (0.0, -0.02)])
def test_one_moving_sample_starts_the_standstill_anew(
    linear: float, angular: float
) -> None:
    bench = pressed()
    for _ in range(10):
        bench.report(bench.ours)
        bench.now += 0.1
    bench.report(bench.ours, linear=linear, angular=angular)
    bench.now += 0.1
    bench.report(bench.ours)

    assert bench.state == "DELIVERED"


def test_fresh_odometry_that_moves_contradicts_the_report() -> None:
    bench = pressed()
    for _ in range(30):
        bench.report(bench.ours)
        bench.odometry(0.3)
        bench.now += 0.1

    assert "standing" not in bench.changes()
    assert bench.state == "DELIVERED"


def test_the_time_to_standstill_is_that_of_the_first_standing_sample() -> None:
    bench = pressed()
    bench.now = 0.4
    bench.report(bench.ours, linear=0.2)
    bench.now = 0.5
    bench.stand()

    assert bench.stop.standstill_ms == pytest.approx(500.0)
    assert bench.stop.times.standing == at(0.5)


def test_a_standing_robot_is_reminded_every_five_seconds() -> None:
    bench = standing()
    reminders = []
    for _ in range(200):
        bench.report(bench.ours)
        reminders += bench.wait(0.1)

    assert len(sends(reminders, "direct")) in (4, 5)
    assert not sends(reminders, "fiware")
    assert bench.state == "STANDING"


def test_a_robot_that_moves_while_standing_is_stopped_again() -> None:
    bench = standing()

    bench.report(bench.ours, linear=0.3)

    assert (bench.state, bench.changes()[-1]) == ("REQUESTED", "moved")


def test_a_hold_that_is_lost_while_standing_is_stopped_again_under_a_new_id() -> None:
    bench = standing()
    lost = bench.ours.id

    effects = bench.report(RED_BUTTON)

    assert (bench.state, bench.changes()[-1]) == ("REQUESTED", "moved")
    assert bench.ours.id != lost
    assert len(sends(effects)) == 2


# --- STALE ------------------------------------------------------------------------


def test_standing_without_a_report_for_a_second_and_a_half_is_stale() -> None:
    bench = standing()

    bench.wait(1.5)
    assert bench.state == "STANDING"
    effects = bench.wait(0.05)

    assert bench.state == "STALE"
    assert sends(effects, "direct")


# --- people -----------------------------------------------------------------------


def test_how_far_it_may_have_driven_grows_with_its_last_speed() -> None:
    bench = Bench()
    assert bench.machine.evidence.moved_m(at(0.0)) == 0.0
    bench.press()
    bench.report(linear=0.8, factor=1.0)

    assert bench.machine.evidence.moved_m(at(2.5)) == pytest.approx(2.0)


# --- the table ------------------------------------------------------------------


def without(*rows: tuple[State, Key]) -> Bench:
    """A machine whose table lacks these rows: a mistake of the program."""
    bench = Bench()
    steps = {row: step for row, step in STEPS.items() if row not in rows}
    bench.machine = StopMachine("AGI", steps=steps)
    return bench


def test_a_stop_has_a_row_in_every_state() -> None:
    keys: tuple[Key, ...] = ("requested", "moved", "reasserted", "release_unconfirmed")

    assert {(state, key) for state in get_args(State) for key in keys} <= STEPS.keys()


def test_after_a_step_without_a_row_stop_stays_wanted_and_is_sent_on() -> None:
    bench = without(("REQUESTED", "unconfirmed"), ("SENT", "unconfirmed"))
    bench.press()
    bench.wait(2.0)

    assert OffTable("AGI", "REQUESTED", "unconfirmed") in bench.log
    assert bench.machine.wants_stop
    assert sends(bench.wait(1.2), "direct")
