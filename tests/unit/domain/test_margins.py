"""The margin is the gap less what stopping takes, term by term."""

from dataclasses import replace

import pytest

from iveg.domain.exposure import Exposure, Exposures
from iveg.domain.margins import LeastMargins, Margin, least, margin_of, margins_of
from tests.builders import at
from tests.unit.domain.scene import Scene, person


def met(distance: float = 10.0, *, linear: float = 1.0, looked_s: float = 0.0) -> Scene:
    """AGI stands or drives, and AGII saw somebody ``distance`` metres before it."""
    scene = Scene()
    scene.drive("AGI", 0.0, linear=linear)
    scene.drive("AGII", 50.0)
    scene.look("AGII", person(distance))
    scene.now = looked_s
    return scene


def margin(scene: Scene, robot_id: str = "AGI") -> Margin:
    (somebody,) = scene.everyone
    found = margin_of(scene.world.robot(robot_id), somebody, at(scene.now))
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("speed", "braking", "age", "needs"),
    [
        (1.0, 0.5, 0.0, 6.65),
        (1.0, 1.0, 0.0, 4.56),
        (1.0, 2.0, 0.0, 3.51),
        (0.5, 0.5, 0.0, 3.91),
        (0.5, 1.0, 0.0, 2.99),
    ],
)
def test_the_need_is_that_of_the_table_of_separation_distances(
    speed: float, braking: float, age: float, needs: float
) -> None:
    reaction = 0.79
    one = Margin(
        "AGI",
        "P1",
        gap_m=2.0,
        walks_m=1.6 * (reaction + speed / braking),
        reaction_m=speed * reaction,
        braking_m=speed**2 / (2 * braking),
        age_s=age,
        speed=speed,
        braking=braking,
    )

    assert one.needs_m == pytest.approx(needs, abs=0.01)
    assert one.margin_m == pytest.approx(2.0 - needs, abs=0.01)


def test_a_robot_whose_brakes_nobody_measured_is_given_half_a_metre_a_second() -> None:
    one = margin(met(linear=1.0))

    assert one.braking == 0.5
    assert one.needs_m == pytest.approx(6.66, abs=0.01)


def test_the_gap_is_between_surfaces() -> None:
    assert margin(met(10.0)).gap_m == pytest.approx(10.0 - 0.99 / 2 - 0.30)


def test_a_standing_robot_needs_only_what_the_person_may_walk() -> None:
    one = margin(met(linear=0.0))

    assert (one.reaction_m, one.braking_m) == (0.0, 0.0)
    assert one.needs_m == pytest.approx(1.6 * 0.79 + 0.40)


def test_driving_backwards_counts_like_forwards() -> None:
    assert margin(met(linear=-1.0)).needs_m == margin(met(linear=1.0)).needs_m


def test_old_data_need_more_room() -> None:
    fresh, old = margin(met(linear=0.5)), margin(met(linear=0.5, looked_s=1.4))

    assert old.age_s == pytest.approx(1.4)
    assert old.walks_m - fresh.walks_m == pytest.approx(1.6 * (1.4 + 0.29 - 0.79))


def test_the_older_of_both_positions_is_the_age() -> None:
    scene = met()
    scene.now = 0.6
    scene.drive("AGI", 0.0, linear=1.0)

    assert margin(scene).age_s == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("left", "band"),
    [(1.0, "clear"), (0.999, "tight"), (0.0, "tight"), (-0.001, "inside")],
)
def test_the_bands_have_their_borders(left: float, band: str) -> None:
    one = margin(met(linear=0.0))

    assert replace(one, gap_m=one.needs_m + left + 1e-12).band == band


def test_a_robot_that_is_lost_has_no_margin_that_is_known() -> None:
    assert margin(met(looked_s=1.5)).band != "unknown"
    assert margin(met(looked_s=1.6)).band == "unknown"


def test_nobody_is_paired_with_a_robot_that_was_never_seen() -> None:
    scene = Scene()
    scene.drive("AGII", 50.0)
    scene.look("AGII", person(10.0))
    (somebody,) = scene.everyone

    assert margin_of(scene.world.robot("AGI"), somebody, at(0.0)) is None


def test_whom_nobody_has_seen_for_ten_seconds_is_no_pair() -> None:
    scene = met(looked_s=10.1)
    scene.drive("AGI", 0.0)
    (somebody,) = scene.everyone

    assert margin_of(scene.world.robot("AGI"), somebody, at(scene.now)) is None


def test_of_two_looks_at_one_person_the_nearer_counts() -> None:
    scene = met(10.0)
    scene.look("AGI", person(9.5))

    assert margin(scene).gap_m == pytest.approx(9.5 - 0.99 / 2 - 0.30)


def test_the_least_margin_is_shown_and_before_it_the_unknown_and_the_negative() -> None:
    one = margin(met())
    inside = replace(one, gap_m=one.needs_m - 0.1)
    near, far = (replace(one, gap_m=one.needs_m + left) for left in (0.5, 5.0))
    unknown = replace(one, gap_m=9.0, known=False)

    assert least([far, near]) is near
    assert least([far, near, unknown]) is unknown
    assert least([far, near, unknown, inside]) is inside
    assert least([]) is None


def test_13_8_who_was_out_of_sight_for_long_has_a_margin_only_from_afar() -> None:
    bands = {}
    for distance in (10.0, 60.0):
        scene = met(distance, linear=0.5)
        for looked_s in (1.4, 1.6, 9.0):
            scene.now = looked_s
            scene.drive("AGI", 0.0, linear=0.5)
            bands[distance, looked_s] = margin(scene).band

    assert bands == {
        (10.0, 1.4): "clear",
        (10.0, 1.6): "clear",
        (10.0, 9.0): "unknown",
        (60.0, 1.4): "clear",
        (60.0, 1.6): "clear",
        (60.0, 9.0): "clear",
    }


def test_all_pairs_at_once_are_the_pairs_one_by_one() -> None:
    scene = Scene()
    for number, robot_id in enumerate(("AGI", "AGII")):
        scene.drive(robot_id, 9.0 * number, linear=0.3 + number)
        scene.look(robot_id, *(person(2.5 + 3.0 * each + number) for each in range(3)))
    scene.now = 1.2
    scene.drive("AGII", 8.0, linear=0.4)
    for now in (at(1.2), at(2.9)):
        robots, people = list(scene.world.robots.values()), scene.everyone
        pairs = list(margins_of(robots, people, now))
        at_once = LeastMargins(robots, people, now)

        assert len(people) > 1
        for robot in robots:
            mine = (one for one in pairs if one.robot_id == robot.robot_id)
            assert at_once.of_robot(robot.robot_id) == least(mine)
        for one in people:
            its = (pair for pair in pairs if pair.person_id == one.person_id)
            assert at_once.of_person(one.person_id) == least(its)


@pytest.mark.parametrize(
    ("distance", "looked_s"),
    [(distance, looked_s) for distance in (2.0, 12.0) for looked_s in (0.0, 1.3, 2.0)],
)
def test_two_margins_tell_the_account_of_the_day_what_all_of_them_do(
    distance: float, looked_s: float
) -> None:
    scene = met(distance)
    scene.look("AGI", person(distance), person(30.0), person(90.0))
    scene.now = looked_s
    scene.drive("AGI", 0.5, linear=0.3)
    scene.look("AGI", person(30.0))
    robots, people, now = scene.world.robots.values(), scene.everyone, at(scene.now)
    account = Exposures(Exposure(since=at(-1.0), evaluated_at=at(scene.now - 0.5)))
    everything = [*margins_of(robots, people, now)]
    telling = LeastMargins(robots, people, now).telling()

    assert len(telling) < len(everything)
    assert replace(account).update(telling, now, seen=True) == replace(account).update(
        everything, now, seen=True
    )


def test_without_robots_or_people_there_is_no_margin() -> None:
    scene = met()
    nobody = LeastMargins([], scene.everyone, at(0.0))
    alone = LeastMargins(scene.world.robots.values(), [], at(0.0))

    assert nobody.telling() == alone.telling() == []
    assert nobody.of_person(scene.everyone[0].person_id) is None
    assert alone.of_robot("AGI") is None
