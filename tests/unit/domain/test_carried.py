"""What goes with a robot is told; people who pass, wait or walk by are not."""

import math
from collections.abc import Callable

import pytest

from iveg.domain.carried import CarriedThings
from iveg.domain.geometry import Pose2D

Seen = Callable[[float, Pose2D], list[tuple[float, float]]]


def drive(seen: Seen, lasts_s: float = 12.0, speed: float = 0.5) -> CarriedThings:
    """What is known after a drive to the east, five pictures a second."""
    things = CarriedThings()
    for step in range(round(lasts_s * 5) + 1):
        pose = Pose2D(speed * step / 5, 0.0, 0.0)
        things.note(pose, seen(step / 5, pose), step / 5)
    return things


def test_what_stays_beside_a_robot_that_drives_is_found() -> None:
    found = drive(lambda _now, _pose: [(1.2, 0.3)]).found(12.0)

    assert found is not None
    assert found.place == (1.2, 0.3)


def test_a_box_that_trembles_and_is_missed_for_half_a_second_stays_the_same() -> None:
    def seen(now: float, _pose: Pose2D) -> list[tuple[float, float]]:
        off = 0.1 * math.sin(9 * now)
        return [] if now % 3.0 < 0.5 else [(1.2 + off, -off)]

    assert drive(seen, 14.0).found(14.0) is not None


@pytest.mark.parametrize(
    "seen",
    [
        lambda _now, pose: [pose.inverse(5.0, 1.0)],
        lambda now, pose: [pose.inverse(1.4 * now, 1.0)],
        lambda now, _pose: [(1.2, 0.3)] if now < 5.0 else [],
        lambda now, _pose: [(1.2, 0.3)] if now % 3.0 < 1.0 else [],
    ],
    ids=["stands", "walks faster", "is gone after 5 s", "comes and goes"],
)
def test_a_person_does_not_go_with_a_robot(seen: Seen) -> None:
    assert drive(seen).found(12.0) is None


def test_before_a_robot_that_stands_a_person_may_stand() -> None:
    assert drive(lambda _now, _pose: [(1.2, 0.3)], speed=0.0).found(12.0) is None


def test_it_is_told_for_ten_seconds_more() -> None:
    things = drive(lambda _now, _pose: [(1.2, 0.3)])

    assert things.found(21.9) is not None
    assert things.found(22.1) is None


def test_among_a_hundred_people_it_keeps_within_bounds() -> None:
    crowd = [(float(n), 0.0) for n in range(100)]

    things = drive(lambda _now, _pose: crowd)
    assert len(things._known) == 8
