"""Who must drive slower and why, at the borders and over time."""

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import CLEAR
from iveg.domain.parameters import ByClass
from tests.unit.domain.scene import HEDGE, Scene, person

RINGS = DetectionRule(foresight=False)
"""Nothing but the rings themselves counts."""


def watching(scene: Scene) -> Scene:
    """Both robots are fresh and look; nobody is near anybody."""
    scene.drive("AGI", 0.0)
    scene.drive("AGII", 50.0)
    scene.look("AGI")
    scene.look("AGII")
    return scene


def step(scene: Scene, x: float) -> tuple[float, str]:
    """AGI stands and AGII sees somebody at ``x``; what AGI must do."""
    scene.drive("AGI", 0.0, linear=0.0)
    scene.drive("AGII", 50.0, linear=0.0)
    scene.look("AGI")
    scene.look("AGII", person(x))
    speed_limit = scene.judge()["AGI"]
    return speed_limit.speed_factor, speed_limit.reason


# --- the ring ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("distance", "factor"), [(0.0, 0.5), (1.999, 0.5), (2.0, 0.5), (2.0001, 1.0)]
)
def test_f47_the_ring_is_two_metres_inclusive(distance: float, factor: float) -> None:
    assert step(Scene(rule=RINGS), distance)[0] == factor


def test_each_class_has_the_radius_that_the_rule_gives_it() -> None:
    wide = DetectionRule(radius_m=ByClass(2.0, {"robot": 3.0}), foresight=False)

    assert step(Scene(rule=wide), 2.5) == (1.0, "clear")
    scene = watching(Scene(rule=wide))
    scene.drive("AGII", 3.0)
    assert scene.judge()["AGI"].reason == "robot"


def test_the_speed_limit_names_its_cause_distance_and_decision() -> None:
    scene = Scene()
    step(scene, 1.5)

    speed_limit = scene.judge()["AGI"]

    assert (speed_limit.speed_factor, speed_limit.reason) == (0.5, "person")
    assert (speed_limit.cause, speed_limit.distance_m) == ("P1", 1.5)
    assert scene.changes[0].began
    assert speed_limit.decision_id == scene.changes[0].entry.decision_id


def test_of_one_person_seen_at_two_places_the_nearer_counts() -> None:
    scene = watching(Scene())
    scene.look("AGI", person(1.5))
    scene.look("AGII", person(1.9))

    speed_limit = scene.judge()["AGI"]

    assert len(scene.everyone) == 1
    assert speed_limit.distance_m == pytest.approx(1.5)


def test_who_does_not_see_is_slowed_and_it_is_known() -> None:
    scene = Scene(greenhouse=HEDGE)
    scene.drive("AGI", 2.5)
    scene.drive("AGII", 10.0)
    scene.look("AGI")
    scene.look("AGII", person(4.0))
    scene.judge()

    (change,) = scene.changes
    assert change.entry.robot_id == "AGI"
    assert not change.entry.in_sight


# --- release ----------------------------------------------------------------------


def leave(scene: Scene, x: float, seconds: float) -> list[float]:
    """The person stays at ``x``; AGI's factors every tenth."""
    factors = []
    for _ in range(round(seconds * 10)):
        scene.now = round(scene.now + 0.1, 6)
        factors.append(step(scene, x)[0])
    return factors


def test_the_release_comes_a_second_after_the_robot_is_030_m_outside() -> None:
    scene = Scene(rule=RINGS)
    step(scene, 1.9)

    factors = leave(scene, 2.35, 1.2)

    assert factors == [0.5] * 10 + [1.0] * 2
    assert [change.began for change in scene.changes] == [True, False]


def test_a_limit_is_told_to_be_over_between_its_end_and_the_release() -> None:
    scene = Scene(rule=RINGS)
    told = []
    for x in (1.9, 2.29, 2.35, 1.9, 2.35):
        scene.now = round(scene.now + 0.1, 6)
        step(scene, x)
        told.append(scene.judge()["AGI"].over)

    assert told == [False, False, True, False, True]


def test_a_limit_with_one_of_two_reasons_left_is_not_over() -> None:
    scene = watching(Scene(rule=RINGS))
    scene.look("AGII", person(1.0), person(-1.0, 1.0))
    scene.judge()
    scene.drive("AGI", 2.0)
    told = scene.judge()["AGI"]
    outside = [one.outside_since for one in scene.speed_limits.entries]
    assert sorted(since is None for since in outside) == [False, True]
    assert not told.over


# --- several reasons --------------------------------------------------------------


def test_f48_two_rings_are_half_speed_and_not_a_quarter() -> None:
    scene = watching(Scene())
    scene.look("AGI", person(1.5), person(-1.5))

    assert scene.judge()["AGI"].speed_factor == 0.5


def test_a_person_is_the_reason_that_is_told_before_a_nearer_peer() -> None:
    scene = Scene()
    scene.drive("AGI", 0.0)
    scene.drive("AGII", 1.0)
    scene.look("AGI", person(1.9))
    scene.look("AGII")

    assert scene.judge()["AGI"].reason == "person"


# --- peers ------------------------------------------------------------------------


def test_a_moving_peer_slows_who_comes_near() -> None:
    scene = watching(Scene())
    scene.drive("AGII", 1.9)

    told = [(one.reason, one.cause) for one in scene.judge().values()]
    assert told == [("robot", "AGII"), ("robot", "AGI")]


def test_a_standing_peer_slows_nobody() -> None:
    scene = watching(Scene())
    scene.drive("AGII", 1.0, linear=0.0)

    assert scene.judge()["AGI"] == CLEAR


@pytest.mark.parametrize(
    ("linear", "after", "reason"),
    [(0.0, 1.1, "robot"), (0.5, 10.1, "clear")],
    ids=["stood", "not heard for ten seconds"],
)
def test_a_peer_that_falls_silent_slows_again_and_not_for_ever(
    linear: float, after: float, reason: str
) -> None:
    scene = watching(Scene())
    scene.drive("AGII", 1.0, linear=linear)
    scene.now = after
    scene.drive("AGI", 0.0)
    scene.look("AGI")
    scene.look("AGII")

    assert scene.judge()["AGI"].reason == reason


# --- silence ----------------------------------------------------------------------


@pytest.mark.parametrize(("age", "reason"), [(1.0, "clear"), (1.01, "stale")])
def test_a_robot_whose_pose_is_silent_for_a_second_is_slowed(
    age: float, reason: str
) -> None:
    scene = watching(Scene())
    scene.now = age
    scene.look("AGI")
    scene.look("AGII")

    assert scene.judge()["AGI"].reason == reason


# --- recordings -------------------------------------------------------------------

RECORDED = ("AGI", "AGII:recording")
BOTH = ("AGI:recording", "AGII:recording")


@pytest.mark.parametrize(
    ("robots", "replay", "x", "judged", "reason"),
    [
        (RECORDED, None, 1.0, "AGI", "clear"),
        (RECORDED, None, 50.5, "AGII", "person"),
        (BOTH, None, 1.0, "AGI", "clear"),
        (BOTH, "shared", 1.0, "AGI", "person"),
    ],
    ids=["no live robot", "itself", "no other recording", "one of the same map"],
)
def test_whom_a_recording_saw_slows_those_of_its_map_alone(
    robots: tuple[str, ...], replay: str | None, x: float, judged: str, reason: str
) -> None:
    scene = watching(Scene(robots=robots, replay=replay))
    scene.look("AGII", person(x))

    assert scene.judge()[judged].reason == reason


def test_a_recording_that_drives_past_slows_no_live_robot() -> None:
    scene = watching(Scene(robots=RECORDED))
    scene.drive("AGII", 1.0)

    speed_limits = scene.judge()

    assert (speed_limits["AGI"], speed_limits["AGII"].reason) == (CLEAR, "robot")


def test_a_peer_whose_pose_goes_on_slows_others_whatever_its_twist_says() -> None:
    scene = Scene(rule=RINGS)
    for number in range(12):
        scene.now = round(scene.now + 0.1, 6)
        scene.drive("AGI", 0.0, linear=0.0)
        scene.drive("AGII", 1.9 - 0.03 * number, linear=0.0)
        scene.look("AGI")
        scene.look("AGII")
        limit = scene.judge()["AGI"]

    assert (limit.speed_factor, limit.reason) == (0.5, "robot")
