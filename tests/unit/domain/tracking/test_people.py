"""How looks become people, and how people age."""

import math
from dataclasses import replace

import pytest

from iveg.domain.observations import Detection
from tests.builders import at, detection, detection_frame, odometry, origin, received
from tests.unit.domain.scene import Scene, machine, person

# --- where ------------------------------------------------------------------------


def test_a_detection_in_base_link_is_placed_with_the_pose_at_its_stamp() -> None:
    scene = Scene()
    for second, x in ((0, 0.0), (1, 10.0)):
        said = odometry(x=x, yaw=math.pi / 2, origin=origin(second, after=second))
        scene.world.apply(received(said, after=second))
    ahead = replace(person(3.0), frame_id="base_link")

    (placed,) = scene.sight(detection_frame("AGI", ahead, origin=origin(1, after=0.5)))

    assert placed.position == pytest.approx((5.0, 3.0, 0.9))


# --- who --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("seen", "kind"),
    [(person(3.0, probability=0.7999999), "faint"), (detection("crate", 3.0), "other")],
)
def test_a_faint_farmer_or_another_object_is_shown_and_is_nobody(
    seen: Detection, kind: str
) -> None:
    scene = Scene()

    (placed,) = scene.look("AGI", seen)

    assert (placed.kind, placed.person) == (kind, None)
    assert scene.everyone == []


def test_who_is_two_metres_away_or_a_robot_is_somebody_else() -> None:
    scene = Scene()
    scene.look("AGI", person(3.0), machine(3.0, 0.1))
    assert [one.person_id for one in scene.everyone] == ["P1", "R2"]
    scene.now = 1.0

    scene.look("AGI", person(5.01))

    assert len(scene.everyone) == 3


def test_one_person_seen_by_two_robots_has_two_observers() -> None:
    scene = Scene()
    scene.look("AGI", person(3.0))
    scene.now = 0.1

    scene.look("AGII", person(3.2))

    (known,) = scene.everyone
    assert set(known.observers(at(0.1))) == {"AGI", "AGII"}
    assert known.newest.observer == "AGII"


def test_a_look_older_than_the_newest_of_its_robot_changes_nothing() -> None:
    scene = Scene()
    scene.now = 1.0
    scene.look("AGI", person(3.0))
    scene.now = 0.5

    scene.look("AGI", person(3.3))

    (known,) = scene.everyone
    assert known.newest.x == 3.0


# --- peers ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robots", "driven", "seen_at", "peer"),
    [
        (("AGI", "AGII"), "AGII", 5.8, "AGII"),
        (("AGI", "AG3"), "AG3", 6.2, None),
        (("AGI", "AGII:recording"), "AGII", 5.0, None),
        (("AGI", "AGII"), "AGI", 5.0, None),
    ],
    ids=["described", "of unknown size", "a recording", "itself"],
)
def test_a_robot_seen_where_a_peer_stands_is_that_peer_and_no_second_robot(
    robots: tuple[str, ...], driven: str, seen_at: float, peer: str | None
) -> None:
    scene = Scene(robots=robots)
    scene.drive(driven, 5.0)

    (placed,) = scene.look("AGI", machine(seen_at))

    assert placed.peer == peer
    assert len(scene.everyone) == (peer is None)


@pytest.mark.parametrize("lie", ["drives on", "silent", "doubted"])
def test_no_robots_word_alone_takes_the_ring_of_what_another_sees_away(
    lie: str,
) -> None:
    scene = Scene()
    scene.drive("AGII", 3.0, linear=0.0)
    if lie == "silent":
        scene.now = 1.1
    if lie == "doubted":
        scene.world.robot("AGII").doubts.contradicted("jumped", at(0.0))
    seen_at = 4.2 if lie == "drives on" else 3.0

    (placed,) = scene.look("AGI", machine(seen_at))

    assert placed.peer is None
    assert [one.class_ for one in scene.everyone] == ["robot"]


# --- ages -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("age", "stage"),
    [
        (0.0, "seen"), (1.0, "seen"), (1.01, "remembered"), (10.0, "remembered"),
        (10.01, "last_seen"), (600.0, "last_seen"), (600.1, "gone"),
    ],
)  # fmt: skip
def test_a_person_is_seen_then_remembered_then_last_seen_then_gone(
    age: float, stage: str
) -> None:
    scene = Scene()
    for tenth in range(-30, 1, 5):
        scene.now = tenth / 10
        scene.look("AGI", person(3.0))

    assert scene.everyone[0].stage(at(age)) == stage


def test_f46_the_ring_of_somebody_whose_observer_died_grows_to_six_metres() -> None:
    scene = Scene()
    scene.look("AGI", person(3.0))
    known = scene.everyone[0]

    found = [known.zone_radii(scene.rule, at(age)) for age in (0, 1.32, 2.82)]
    radii = [next(iter(one))[1] for one in found]

    assert radii == pytest.approx([2.0, 3.6, 6.0])
    assert list(known.zone_radii(scene.rule, at(10.0)))
    assert not list(known.zone_radii(scene.rule, at(10.01)))
