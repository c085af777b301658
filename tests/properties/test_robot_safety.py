"""The robot's invariants R1-R10 (docs/safety.md), under everything a network can do."""
# ruff: noqa: N802 - each test bears the name of its invariant

import itertools
from collections.abc import Callable
from dataclasses import replace

import orjson
from hypothesis import example, given
from hypothesis import strategies as st

from iveg.domain.feedback import CLEAR, Feedback, FeedbackAlert, SpeedLimit
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import Origin, SafetyReport
from iveg.domain.parameters import Class
from iveg.ngsi import codec
from iveg.robot.feedback import Authors
from iveg.robot.gate import Cap, lowest
from iveg.robot.judgement import Judgement, Limits
from iveg.robot.safety import Drive
from tests.unit.robot.hostile import (
    EVENTS,
    JUNK,
    NAMES,
    Event,
    Transition,
    World,
    played,
    reports,
)
from tests.unit.robot.rig import AHEAD, REST, Rig, person, release, stop


def released_by(transition: Transition) -> tuple[set[str], str]:
    """The ids and challenge of a release; nothing for any other message."""
    try:
        message = orjson.loads(transition.payload or b"")
        asked = message["cmd"]["release"]
        return set(asked["ids"]), asked["ch"]
    except (orjson.JSONDecodeError, KeyError, TypeError):
        return set(), ""


@given(EVENTS)
@example([Event("lose_iveg")])
def test_R1_driving_implies_an_empty_hold_set(events: list[Event]) -> None:
    moving = [one for one in played(events).transitions if one.moves]
    assert moving
    assert all(one.after.holds == () for one in moving)
    assert all(one.state == "RUNNING" for one in moving)


@given(EVENTS)
def test_R2_a_received_stop_stays_until_a_release_with_all_names_and_the_challenge(
    events: list[Event],
) -> None:
    world = played(events)
    for one in world.transitions:
        named, challenge = released_by(one)
        perfect = one.before.remote <= named and challenge == one.challenge
        lost = [hold for hold in one.lost if hold.source == "iveg"]
        assert perfect or not lost


@given(EVENTS)
def test_R2_every_stop_that_comes_is_held_or_was_released(events: list[Event]) -> None:
    pressed = [one for one in played(events).transitions if one.did == "press"]
    for one in pressed:
        name = orjson.loads(one.payload or b"")["cmd"]["stop"]["id"]
        released = name in one.before.released
        assert (name in one.after.remote) != released
        assert one.answers == ["RELEASED" if released else "LATCHED"]


CROWDS = st.tuples(
    st.integers(1, 90), st.lists(st.integers(0, 89), max_size=12), st.booleans()
)
"""So many STOPs of different names, which come again, and whether it reboots."""


def crowded(crowd: tuple[int, list[int], bool]) -> tuple[World, list[str]]:
    """A standing robot that all of them have stopped, and their names."""
    count, again, reboots = crowd
    names = [f"01N{number}" for number in range(count)]
    world = played([])
    world.wished = REST
    world.run(0.6)
    for name in names:
        world.press(name)
    for number in again:
        world.press(names[number % count])
    if reboots:
        world.reboot()
        world.run(0.6)
    return world, names


def read_back(world: World) -> SafetyReport:
    """The last report as iVeg reads it."""
    report = replace(world.reports[-1], origin=Origin("b", 1))
    reading = codec.read_measure("AGI_safety", codec.write_measure(report))
    (read,) = reading.observations
    assert isinstance(read, SafetyReport)
    return read


@given(CROWDS, st.sampled_from(["01NEW", "01N0", "01N1"]))
def test_R2_however_many_hold_it_the_newest_stop_is_named_in_a_readable_report(
    crowd: tuple[int, list[int], bool], newest: str
) -> None:
    world, _ = crowded(crowd)
    world.press(newest)
    assert newest in {hold.id for hold in read_back(world).holds}


@given(CROWDS)
def test_R2_however_many_come_no_stop_is_dropped(
    crowd: tuple[int, list[int], bool],
) -> None:
    world, names = crowded(crowd)
    holds = world.machine.holds
    assert set(names) <= holds.remote | set(holds.joined)
    assert holds.remote.isdisjoint(holds.joined)


@given(CROWDS, st.data())
def test_R2_a_full_robot_is_let_go_by_all_its_names_and_the_newest_challenge_alone(
    crowd: tuple[int, list[int], bool], data: st.DataObject
) -> None:
    world, names = crowded(crowd)
    told = read_back(world)
    seen = [hold.id for hold in told.holds if hold.ack == "remote"]
    forgotten = data.draw(st.sampled_from(seen))
    fewer = [one for one in seen if one != forgotten] or ["nobody"]
    assert world.command(release(fewer, world.machine.challenge)).result == "REFUSED"
    early = release(seen, world.machine.challenge)
    world.press("01LATE")
    assert world.command(early).result == "REFUSED"
    assert world.release().result == "RELEASED"
    assert world.machine.holds.remote == set()
    kept = set(names[-40:]) & set(world.machine.holds.released)
    assert kept
    assert {world.stop(name).result for name in kept} == {"RELEASED"}


@given(EVENTS)
def test_R3_a_release_lifts_no_hold_that_it_does_not_name(events: list[Event]) -> None:
    commanded = [one for one in played(events).transitions if one.payload is not None]
    for one in commanded:
        named, _ = released_by(one)
        # A link hold clears itself by time alone, whatever comes at that moment.
        assert {hold.id for hold in one.lost if hold.ack != "auto"} <= named


@given(EVENTS, st.lists(NAMES, min_size=1, max_size=3))
def test_R4_a_boot_is_held_and_inherits_every_answered_stop(
    events: list[Event], names: list[str]
) -> None:
    world = played(events)
    for name in names:
        world.press(name)
    held = {hold for hold in world.machine.holds.holds if hold.source == "iveg"}
    world.reboot()
    assert held <= set(world.machine.holds.holds)
    assert all(
        one.after.holds[-1].id.startswith("boot-") and not one.moves
        for one in world.boots
    )


@given(EVENTS, st.binary(max_size=8), st.binary(max_size=8))
def test_R5_any_stop_gives_zero_in_the_same_call(
    events: list[Event], left: bytes, right: bytes
) -> None:
    world = played(events)
    for payload in (stop("01NEW"), left + b"StOp" + right):
        effects = world.machine.command(payload, world.now)
        assert effects[0] == Drive(REST)
        world.perform(effects)


CAPS = st.lists(
    st.builds(
        Cap,
        st.sampled_from([0.0, 0.5, 1.0]),
        st.sampled_from(["stale", "watchdog", "robot", "person"]),
        st.sampled_from([None, "AGII"]),
    )
)


@given(CAPS, CAPS)
def test_R6_the_factor_is_the_least_cap_and_more_caps_never_raise_it(
    some: list[Cap], more: list[Cap]
) -> None:
    assert lowest(some).factor == min([1.0, *(cap.factor for cap in some)])
    assert lowest([*some, *more]).factor <= lowest(some).factor


@given(EVENTS)
def test_R6_every_reported_factor_is_0_or_half_or_1(events: list[Event]) -> None:
    factors = {factor for _, factor in reports(played(events))}
    assert factors <= {0.0, 0.5, 1.0}


TOLD = st.lists(
    st.tuples(st.sampled_from([0.5, 1.0]), st.sampled_from([None, 0.5, 1.9, 2.2, 3.0])),
    max_size=6,
)
OTHERS = st.lists(
    st.tuples(
        st.sampled_from(["person", "robot"]), st.sampled_from([0.2, 1.5, 2.0, 2.2])
    ),
    max_size=3,
)
NAMED = st.sampled_from(["cloud", "another", "b{}"]), st.sampled_from([-9, 0, 1, 2**40])
"""Boot, which may change each time, and count beyond the honest one's, of a liar."""


def slower_by(
    told: list[tuple[float, float | None]],
    others: list[tuple[Class, float]],
    lie: Callable[[Rig, tuple[FeedbackAlert, ...], int], Feedback],
) -> bool:
    """Whether a robot that hears more than its twin is never faster than that."""
    one, two = Rig().drive_on(), Rig().drive_on()
    more = tuple(person(x, class_=kind, decision_id=f"o-{x}") for kind, x in others)
    slower = True
    for number, (factor, x) in enumerate(told):
        for rig in (one, two):
            rig.speed_limits = {"AGI": SpeedLimit(factor, "person")}
            rig.alerts = () if x is None else (person(x),)
        for _ in range(7):
            lied = lie(two, more, number)
            two.hear(lied, lied.robot_id)
            one.run(0.1)
            two.run(0.1)
            slower = slower and two.factor <= one.factor
    return slower


@given(TOLD, OTHERS, st.sampled_from([0.0, 0.5, 1.0]))
def test_R6_another_topic_never_raises_the_factor(
    told: list[tuple[float, float | None]],
    others: list[tuple[Class, float]],
    factor: float,
) -> None:
    def lie(rig: Rig, more: tuple[FeedbackAlert, ...], _: int) -> Feedback:
        limits = {"AGI": SpeedLimit(factor, "robot")}
        return rig.feedback(robot_id="AGIII", alerts=more, speed_limits=limits, seen={})

    assert slower_by(told, others, lie)


@given(TOLD, OTHERS, *NAMED, st.booleans())
def test_R6_another_author_never_raises_the_factor(
    told: list[tuple[float, float | None]],
    others: list[tuple[Class, float]],
    boot: str,
    ahead: int,
    sees: bool,
) -> None:
    def lie(rig: Rig, more: tuple[FeedbackAlert, ...], number: int) -> Feedback:
        origin = Origin(boot.format(number), max(0, rig.feedback_seq + ahead))
        seen = {"AGI": rig.report_seq} if sees else {}
        said = rig.feedback(alerts=more, speed_limits={"AGI": CLEAR}, seen=seen)
        rig.feedback_seq -= 1  # it is not iVeg's
        return replace(said, origin=origin)

    assert slower_by(told, others, lie)


@given(*NAMED)
def test_R6_one_stray_message_holds_nobody_and_is_over_after_ten_seconds(
    boot: str, ahead: int
) -> None:
    rig = Rig().drive_on()
    stray = Origin(boot.format(1), max(0, rig.feedback_seq + ahead))
    rig.hear(Feedback("AGII", stray, speed_limits={"AGI": CLEAR}))
    before = len(rig.reports)
    rig.run(10.0)
    assert {report.speed_factor for report in rig.reports[before:]} <= {0.5, 1.0}
    rig.run(1.5)
    assert rig.factor == 1.0


@given(EVENTS)
def test_R7_feedback_older_than_1_s_halves_and_older_than_3_s_stops(
    events: list[Event],
) -> None:
    for one in played(events).transitions:
        fastest = max(abs(twist.linear_x) for twist in one.twists)
        age = float("inf") if one.heard is None else one.at - one.heard
        assert age <= 1.0 or fastest <= 0.5
        assert age <= 3.0 or fastest == 0.0


@given(st.lists(st.integers(0, 3), max_size=12))
def test_R7_each_author_that_is_older_than_1_s_halves_until_it_was_silent_for_10(
    silences: list[int],
) -> None:
    authors, spoke = Authors("AGI", 1.0), dict[str, float]()
    for second, silent in enumerate([*silences, *[0] * 12]):
        now = float(second)
        for boot in "abc"[silent:]:
            spoke[boot] = now
            said = Feedback("AGII", Origin(boot, second), speed_limits={"AGI": CLEAR})
            authors.apply("AGII", said, None, now, now)
        for later in (now, now + 0.9):
            factor = lowest(authors.caps(None, False, later)).factor
            ages = [later - at for at in spoke.values()]
            assert factor == (0.5 if any(1.0 < age <= 10.0 for age in ages) else 1.0)


@given(EVENTS)
def test_R7_the_reported_factor_obeys_the_same_limits(events: list[Event]) -> None:
    for one, factor in reports(played(events)):
        age = float("inf") if one.heard is None else one.at - one.heard
        assert age <= 1.0 or factor <= 0.5
        assert age <= 3.0 or factor == 0.0


@given(EVENTS)
def test_R8_local_holds_are_lifted_by_a_crew_alone(events: list[Event]) -> None:
    for one in played(events).transitions:
        lost = [hold for hold in one.lost if hold.ack == "local"]
        assert not lost or one.did in ("crew", "full_speed")
        assert not lost or one.payload is None


def without_stop(payload: bytes) -> bool:
    return b"stop" not in payload.lower()


@given(
    EVENTS,
    st.lists(
        st.one_of(
            st.builds(Event, st.just("say"), st.tuples(JUNK.filter(without_stop))),
            st.builds(Event, st.just("hear_again"), st.tuples(st.integers(0, 400))),
        ),
        max_size=10,
    ),
)
def test_R9_junk_and_old_feedback_change_no_hold_and_move_nothing(
    events: list[Event], noise: list[Event]
) -> None:
    world = played(events)
    before, state = world.machine.holds, world.state
    twist = world.twist
    world.play(noise)
    assert world.machine.holds.holds == before.holds
    assert world.state == state
    assert abs(world.twist.linear_x) <= abs(twist.linear_x)


@given(EVENTS, st.permutations(range(40)))
def test_R9_commands_delivered_again_in_any_order_never_free_a_robot(
    events: list[Event], order: list[int]
) -> None:
    world = played(events)
    world.press("01HOLD")
    for which in order:
        world.again(which)
    assert "01HOLD" in world.machine.holds.remote
    assert world.twist == REST


@given(EVENTS, st.permutations(range(40)))
def test_R9_commands_delivered_again_never_make_a_waiting_robot_run(
    events: list[Event], order: list[int]
) -> None:
    world = played(events)
    world.press("01HOLD")
    world.sensors(True)
    world.push(0.0)
    world.wait(0.6)
    world.crew()
    world.ask_resume("perfect")
    world.ask_release("perfect")
    assert world.machine.holds.remote == set()
    for which in order:
        world.again(which)
    assert world.state != "RUNNING"


@given(EVENTS, st.lists(st.integers(0, 40), max_size=20))
def test_R9_the_copies_of_an_attempt_are_answered_alike_and_change_nothing(
    events: list[Event], copies: list[int]
) -> None:
    world = played(events)
    for which in copies:
        world.again(which)
    verdicts = Verdicts()
    for one in world.transitions:
        verdicts.watch(one)
    assert all(len(answers) == 1 for answers in verdicts.first.values())


class Verdicts:
    """What each attempt was answered first, in one life of the robot."""

    def __init__(self) -> None:
        self.first: dict[str, list[str]] = {}
        self.delivered: set[bytes] = set()

    def watch(self, one: Transition) -> None:
        if one.did in ("reboot", "cut"):
            self.first.clear()
        attempt = attempt_of(one)
        if attempt is None:
            return
        known = self.first.setdefault(attempt, one.answers)
        assert one.answers == known
        if one.payload in self.delivered:
            assert {hold for hold in one.lost if hold.ack != "auto"} == set()
        self.delivered.add(one.payload or b"")


def attempt_of(one: Transition) -> str | None:
    """The attempt that a release or resume names."""
    try:
        (asked,) = orjson.loads(one.payload or b"")["cmd"].values()
        named = asked["attempt"]
    except (orjson.JSONDecodeError, KeyError, TypeError, ValueError, AttributeError):
        return None
    return named if isinstance(named, str) else None


@given(EVENTS)
def test_R9_an_order_that_succeeds_spends_its_challenge(events: list[Event]) -> None:
    world = played(events)
    for one, then in itertools.pairwise(world.transitions):
        acted = one.answers in (["RELEASED"], ["RESUMED"]) and (
            one.challenge.encode() in (one.payload or b"")
        )
        assert not acted or then.challenge != one.challenge


@given(EVENTS)
def test_R10_after_a_release_motion_needs_resume_and_half_a_second_of_rest(
    events: list[Event],
) -> None:
    interlock = Interlock()
    for one in played(events).transitions:
        interlock.watch(one)
        assert interlock.passed or not one.moves


class Interlock:
    """R10 once more, from what went in alone."""

    def __init__(self) -> None:
        self.resumed_at: float | None = None
        self.passed = False

    def watch(self, one: Transition) -> None:
        if any(hold.ack != "auto" for hold in one.after.holds):
            self.resumed_at, self.passed = None, False
        elif self.resumed_at is None and may_resume(one):
            self.resumed_at = one.at
        if self.resumed_at is not None and one.at_rest_since is not None:
            rest = one.at - max(self.resumed_at, one.at_rest_since)
            self.passed = self.passed or rest >= 0.5 - 1e-6


def may_resume(one: Transition) -> bool:
    """Whether this call may let a robot run: a resume with the challenge, a crew."""
    if one.payload is None:
        return one.did in ("crew", "full_speed")
    return one.answers == ["RESUMED"] and one.challenge.encode() in one.payload


@given(EVENTS)
def test_the_order_of_effects_is_zero_disk_answer_report(events: list[Event]) -> None:
    rank = {"Drive": 0, "Persist": 1, "SendAnswer": 2, "Report": 3}
    for one in played(events).transitions:
        order = [rank[type(effect).__name__] for effect in one.effects]
        assert order == sorted(order)
        assert order[0] == 0


@given(EVENTS)
def test_L2_nobody_is_locked_out_for_ever(events: list[Event]) -> None:
    world = played(events)
    world.alerts, world.speed_limits = (), {"AGI": CLEAR}
    world.full_speed()
    world.wait(3.4)
    world.full_speed()
    world.wait(3.4)
    assert world.twist == AHEAD


@given(
    st.lists(st.floats(-0.14, 0.14), min_size=30, max_size=60),
    st.floats(1.0, 3.0),
)
def test_noise_below_the_hysteresis_changes_the_factor_at_most_once_a_crossing(
    noise: list[float], distance: float
) -> None:
    rig = Rig().drive_on()
    before = rig.factor_changes()
    for wobble in noise:
        rig.pose = Pose2D(wobble, 0.0, 0.0)
        rig.alerts = (replace(person(distance), stamp=str(wobble)),)
        rig.run(0.2)
    assert rig.factor_changes() - before <= 1


_TOLD = {
    "clear": CLEAR,
    "person": SpeedLimit(0.5, "person"),
    "over": SpeedLimit(0.5, "person", over=True),
}


@given(st.lists(st.tuples(st.sampled_from([*_TOLD]), st.integers(1, 6)), max_size=12))
@example([("person", 1), ("over", 2), ("clear", 4)])
def test_a_limit_goes_a_second_after_its_reason_and_no_second_later(
    run: list[tuple[str, int]],
) -> None:
    judgement, ended = Judgement("AGI", 0.0, Limits()), 0
    steps = [what for what, count in [("clear", 6), *run] for _ in range(count)]
    for seq, what in enumerate(steps, 1):
        now = seq / 4
        judgement.watchdog.sent(seq, now)
        judgement.note_odometry(Pose2D(0.0, 0.0, 0.0), REST, now)
        limits, seen = {"AGI": _TOLD[what]}, {"AGI": seq}
        told = Feedback("AGII", Origin("b", seq), speed_limits=limits, seen=seen)
        judgement.note_feedback("AGII", told, now)
        judgement.settle(now)
        ended = seq if what == "person" else ended
        is_free = what == "clear" and seq - ended > 4
        assert (judgement.cap.factor == 1.0) == is_free


@given(st.floats(-10, 10), st.floats(-10, 10), st.sampled_from([0.0, 0.5, 1.0]))
def test_no_wish_exceeds_the_drive_times_the_factor(
    linear: float, angular: float, factor: float
) -> None:
    rig = Rig().drive_on()
    rig.speed_limits = {"AGI": SpeedLimit(factor, "person")}
    rig.wished = Twist2D(linear, angular)
    rig.run(0.3)
    for _ in range(40):
        rig.step()
        assert abs(rig.twist.linear_x) <= factor + 1e-9
        assert abs(rig.twist.angular_z) <= factor + 1e-9
