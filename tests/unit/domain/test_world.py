"""Ages, links, and what a message may change."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.fleet import RobotDescription
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    CommandAnswer,
    FeedbackRef,
    Navigation,
    Observation,
    Odometry,
    Origin,
    Received,
    SafetyReport,
)
from iveg.domain.probe import ProbeLag
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.zones import zones_of
from iveg.domain.tracking.people import People
from iveg.domain.transports import DIRECT, FIWARE
from iveg.domain.world import World
from tests.builders import (
    START,
    at,
    detection_frame,
    fleet_of,
    odometry,
    origin,
    received,
    safety_report,
    scan,
)


def world_with(*observations: Observation) -> World:
    world = World(["AGI", "AGII"])
    for observation in observations:
        world.apply(received(observation))
    return world


def asked(observation: Observation, after: float = 0.0) -> Received:
    return replace(received(observation, after=after), is_query_answer=True)


# --- links ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("age", "link"),
    [
        (0.0, "LIVE"), (1.0, "LIVE"), (1.001, "LATE"), (3.0, "LATE"), (3.001, "LOST"),
        (1e6, "LOST"),
    ],
)  # fmt: skip
def test_the_link_is_live_to_1_s_late_to_3_s_then_lost(age: float, link: str) -> None:
    robot = world_with(odometry()).robot("AGI")

    assert robot.link(at(age)) == link


def test_only_odometry_makes_a_robot_live() -> None:
    world = world_with(safety_report(), scan(), detection_frame())

    assert world.robot("AGI").link(at(0.0)) == "UNKNOWN"


@pytest.mark.parametrize(
    ("linear", "angular", "stands"),
    [(0.0, 0.0, True), (0.0199, -0.0199, True), (0.02, 0.0, False), (0.0, 0.02, False)],
)
def test_a_robot_stands_below_two_centimetres_a_second(
    linear: float, angular: float, stands: bool
) -> None:
    world = world_with(odometry(linear=linear, angular=angular))

    assert world.robot("AGI").stands is stands


# --- proven ages ------------------------------------------------------------------


def echoing(seq: int, heard: int | None, boot: str = "boot-a") -> Origin:
    """Of a robot that tells which feedback of ``iveg`` it had heard, if any."""
    ref = None if heard is None else FeedbackRef("iveg", heard)
    return replace(origin(seq, boot=boot), acknowledgements=True, heard=ref)


def world_that_told(*moments: float) -> World:
    """Feedback 1, 2, … was composed at these moments (s)."""
    world = World(["AGI", "AGII"])
    for seq, moment in enumerate(moments, start=1):
        world.ledger.composed("iveg", seq, seq, at(moment).mono)
    return world


def test_what_a_robot_says_is_as_old_as_the_feedback_that_it_had_heard() -> None:
    world = world_that_told(0.0, 5.0)
    report = safety_report(origin=echoing(1, heard=1))
    world.apply(received(odometry(origin=echoing(1, heard=1)), after=6.0))
    world.apply(received(report, after=6.0))
    world.apply(received(detection_frame(origin=echoing(1, heard=2)), after=6.0))

    robot = world.robot("AGI")
    assert (robot.age_s(at(6.0)), robot.link(at(6.0))) == (6.0, "LOST")
    assert robot.estimated_since is None
    assert robot.safety_received == at(0.0)
    assert robot.detections_at == at(5.0).mono
    assert robot.sighted_at == at(5.0)
    assert world.age_then(received(report, after=6.0)) == 6.0


@pytest.mark.parametrize("heard", [None, 3])
def test_while_nothing_is_proven_the_age_is_unknown_and_lost_after_three_seconds(
    heard: int | None,
) -> None:
    world = world_that_told(0.0)
    for second in range(5):
        one = odometry(origin=echoing(second + 1, heard=heard))
        world.apply(received(one, after=float(second)))

    robot = world.robot("AGI")
    assert robot.age_s(at(3.0)) is None
    assert [robot.link(at(s)) for s in (3.0, 3.1)] == ["UNKNOWN", "LOST"]


@pytest.mark.parametrize("heard", [1, None])
def test_another_boot_inherits_no_proof(heard: int | None) -> None:
    world = world_that_told(0.0, 5.0)
    world.apply(received(odometry(origin=echoing(1, heard=1)), after=1.0))
    world.apply(received(odometry(origin=echoing(2, heard=2)), after=5.1))
    world.apply(received(odometry(origin=echoing(1, heard=heard, boot="b")), after=5.2))

    assert world.robot("AGI").link(at(5.2)) in ("LOST", "UNKNOWN")


def test_a_boot_displaced_by_an_unproven_one_returns_by_feedback_from_after_that() -> (
    None
):
    world = world_that_told(0.0, 5.0, 6.0)
    said = [
        (5.1, echoing(1, heard=2)),
        (5.2, echoing(1, heard=1, boot="earlier")),
        (5.5, echoing(900, heard=None, boot="earlier")),
        (5.6, echoing(2, heard=2)),
        (6.1, echoing(3, heard=3)),
        (6.2, echoing(901, heard=None, boot="earlier")),
    ]

    verdicts = [world.apply(received(odometry(origin=o), after=s)) for s, o in said]

    assert verdicts == ["new", "late", "new", "late", "new", "late"]


def test_two_robots_of_one_name_that_both_echo_do_not_take_turns() -> None:
    world = world_that_told(*(0.1 * number for number in range(20)))
    said = [
        (0.1 * number + 0.05, echoing(number, heard=number, boot=f"b{number % 2}"))
        for number in range(1, 20)
    ]

    verdicts = [world.apply(received(odometry(origin=o), after=s)) for s, o in said]

    assert verdicts[2:] == ["late", "new"] * 8 + ["late"]


# --- what may act on a STOP -------------------------------------------------------


@pytest.mark.parametrize(
    ("of_now", "may_act"),
    [
        (echoing(1, heard=2), True),
        (echoing(1, heard=1), False),
        (echoing(1, heard=None), False),
        (origin(1), True),
    ],
    ids=["proven", "earlier boot", "unproven", "estimated"],
)
@pytest.mark.parametrize("build", [safety_report, odometry])
def test_where_a_robot_proves_ages_only_a_proof_of_its_present_boot_acts(
    build: Callable[..., Odometry | SafetyReport], of_now: Origin, may_act: bool
) -> None:
    world = world_that_told(0.0, 5.0)
    look = detection_frame(origin=echoing(1, heard=2, boot="present"))
    world.apply(received(look, after=5.1))
    one = received(build(origin=of_now), after=5.2)
    world.apply(one)

    assert world.may_act(one) is may_act
    answer = CommandAnswer("AGI", of_now, "01STOP", "LATCHED")
    assert world.may_act(received(answer)), "it names its order"


def test_a_robot_that_moves_is_a_hazard_though_nobody_knows_how_old_its_pose_is() -> (
    None
):
    world = world_that_told(0.0)
    world.apply(received(odometry("AGII", 1.0, origin=echoing(1, heard=None))))

    found = zones_of(world, People(), DetectionRule(), at(0.5))

    assert [zone.cause for zone in found] == ["AGII"]


def test_an_old_look_makes_an_old_sighting_even_when_it_is_late() -> None:
    world = world_that_told(0.0, 20.0)
    world.apply(received(detection_frame(origin=echoing(9, heard=2)), after=20.1))
    world.apply(received(detection_frame(origin=echoing(3, heard=1)), after=20.2))

    assert world.robot("AGI").sighted_at == at(0.0)
    assert world.robot("AGI").detections_at == at(20.0).mono


# --- estimated ages ---------------------------------------------------------------


def world_behind(*probes: tuple[float, float]) -> World:
    """Probes of ours left and came back at these moments (s)."""
    lag = ProbeLag()
    for seq, (left, back) in enumerate(probes):
        lag.sent(Origin("iveg", seq), at(left))
        lag.returned(Origin("iveg", seq), at(back))
    return World(["AGI"], lag)


def test_what_fiware_alone_brings_is_no_younger_than_our_probe_and_proves_nothing() -> (
    None
):
    world = world_behind((-25.0, 0.0))
    world.apply(received(odometry()))

    robot = world.robot("AGI")
    assert robot.age_s(at(0.0)) == 25.0
    assert robot.estimated_since == START.mono
    assert world.age_then(received(odometry())) == float("inf")
    assert world.age_then(received(safety_report())) == float("inf")


# --- what was asked of Orion ------------------------------------------------------


def test_what_was_asked_of_orion_never_looks_live() -> None:
    world = World(["AGI"])
    for one in (odometry(), safety_report(), scan()):
        world.apply(asked(one))

    robot = world.robot("AGI")
    assert robot.link(at(0.0)) == "LOST"
    assert robot.odometry is not None
    assert robot.clock.offset_s(at(0.0)) is None
    for heard in (robot.safety_received, robot.scan_received):
        assert heard is not None
        assert at(0.0).mono - heard.mono > 3.0


def test_what_was_asked_is_at_least_as_old_as_its_stamp_says() -> None:
    world = World(["AGI"])
    world.apply(asked(odometry(origin=origin(1, after=-60.0))))

    assert world.robot("AGI").age_s(at(0.0)) == pytest.approx(60.0)


def test_what_was_asked_does_not_disturb_a_robot_without_identity() -> None:
    world = World(["AGI"])
    world.apply(received(odometry(x=1.0, origin=Origin())))

    freshness = world.apply(asked(odometry(x=2.0, origin=Origin())))

    robot = world.robot("AGI")
    assert freshness == "duplicate"
    assert robot.odometry is not None
    assert robot.odometry.pose.x == 1.0
    assert robot.link(at(0.0)) == "LIVE"


def test_an_answer_displaces_no_live_robot() -> None:
    world = World(["AGI"])
    world.apply(received(odometry(x=1.0, origin=origin(1, boot="today"))))

    kept = asked(odometry(x=9.0, origin=origin(900, boot="yesterday")), after=0.1)
    assert world.apply(kept) == "duplicate"
    newer = asked(odometry(x=2.0, origin=origin(2, boot="today")), after=0.1)
    assert world.apply(newer) == "stored"

    robot = world.robot("AGI")
    assert robot.odometry is not None
    assert robot.odometry.pose.x == 2.0
    assert robot.age_s(at(0.1)) == pytest.approx(0.1)


# --- what a message changes -------------------------------------------------------


def test_the_newest_by_count_wins_whatever_brought_it() -> None:
    world = World(["AGI"])
    verdicts = [
        world.apply(
            received(odometry(x=float(seq), origin=origin(seq)), transport=transport)
        )
        for transport, seq in (
            (DIRECT.id, 2), (FIWARE.id, 1), (FIWARE.id, 2), (FIWARE.id, 3),
            (DIRECT.id, 3),
        )
    ]  # fmt: skip
    robot = world.robot("AGI")

    assert verdicts == ["new", "late", "duplicate", "new", "duplicate"]
    assert robot.odometry is not None
    assert robot.odometry.pose.x == 3.0
    assert robot.odometry_transport == FIWARE.id


def test_a_robot_without_a_count_is_read_directly_while_that_works() -> None:
    world = World(["AGI"])
    blank = odometry(origin=Origin())
    assert world.apply(received(blank, after=0.0, transport=DIRECT.id)) == "new"
    assert world.apply(received(blank, after=0.9, transport=FIWARE.id)) == "duplicate"
    assert world.apply(received(blank, after=1.1, transport=FIWARE.id)) == "new"


# --- live or recorded -------------------------------------------------------------

PLAYED = replace(origin(), replay="AGI")


def recording() -> World:
    """AGI is a recording, AGII is live."""
    return World(fleet_of("AGI:recording", "AGII"))


@pytest.mark.parametrize(
    "said",
    [
        odometry(origin=PLAYED),
        scan(origin=PLAYED),
        detection_frame(unreadable=1, origin=PLAYED),
        safety_report(origin=PLAYED),
        Navigation("AGI", PLAYED, "patrol"),
        CommandAnswer("AGI", PLAYED, "01J", "LATCHED"),
    ],
)
def test_what_calls_itself_a_replay_counts_for_nothing_in_a_live_robot(
    said: Observation,
) -> None:
    world = World(fleet_of("AGI"))

    assert world.apply(asked(said)) == "refused"
    assert world.robot("AGI").refused_at is None, "no news of today"
    assert world.apply(received(said)) == "refused"

    untouched = World(fleet_of("AGI")).robot("AGI")
    untouched.refused_at = START.mono
    assert world.robot("AGI") == untouched


def test_a_recording_is_in_a_map_of_its_own_until_it_names_another() -> None:
    world = recording()
    assert world.robot("AGI").recording == "AGI"

    world.apply(received(odometry(origin=replace(origin(), replay="shared"))))

    assert world.robot("AGI").recording == "shared"
    assert world.robot("AGII").recording is None


def test_a_recording_whose_safety_node_marks_nothing_today_counts_as_live() -> None:
    world = recording()
    world.apply(received(odometry()))
    world.apply(asked(safety_report()))
    assert world.robot("AGI").is_replay

    world.apply(received(safety_report()))

    assert not world.robot("AGI").is_replay
    assert world.apply(received(odometry(origin=PLAYED))) == "refused"


# --- poses in the past ------------------------------------------------------------


def driven() -> RobotState:
    """One metre a second along x, a pose every second."""
    world = World(["AGI"])
    for second in range(10):
        one = odometry(x=float(second), origin=origin(second, after=second))
        world.apply(received(one, after=second))
    return world.robot("AGI")


@pytest.mark.parametrize(
    ("after", "x"),
    [(3.25, 3.25), (-0.9, 0.0), (99.0, 9.0), (-600.0, 9.0), (None, 9.0)],
    ids=["interpolated", "before", "after", "of another clock", "without a stamp"],
)
def test_the_pose_at_a_stamp_is_interpolated_or_the_nearest(
    after: float | None, x: float
) -> None:
    stamp_s = None if after is None else START.wall + after

    assert driven().pose_at_stamp(stamp_s) == Pose2D(x, 0.0, 0.0)
    unseen = RobotState("AGI", RobotDescription("AGI"))
    assert unseen.pose_at_stamp(stamp_s) is None


def test_a_clock_that_jumps_back_or_another_boot_begins_the_history_anew() -> None:
    robot = driven()
    robot.remember_pose(START.wall - 3600.0, Pose2D(50.0, 0.0, 0.0))
    assert robot.pose_at_stamp(START.wall + 3.0) == Pose2D(50.0, 0.0, 0.0)

    world = World(["AGI"])
    for boot, x, mono in (("a", 1.0, 5.0), ("b", 9.0, 6.0)):
        said = replace(origin(1, boot=boot), mono=mono)
        world.apply(received(odometry(x=x, origin=said)))
    assert world.robot("AGI").pose_at_stamp(5.5) == Pose2D(9.0, 0.0, 0.0)


@pytest.mark.parametrize("step_s", [0.0, 3600.0, -3600.0])
def test_a_clock_that_is_set_does_not_misplace_a_scan(step_s: float) -> None:
    world = World(["AGI"])
    for second in range(5):
        said = replace(origin(second + 1, after=float(second)), mono=float(second))
        world.apply(received(odometry(x=float(second), origin=said), after=second))

    late = replace(origin(1, after=3.5 + step_s), mono=3.5)
    world.apply(received(scan(origin=late), after=4.0))

    assert world.robot("AGI").scan_pose == Pose2D(3.5, 0.0, 0.0)
