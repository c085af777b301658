"""The margin is the gap less what stopping takes, term by term."""

from dataclasses import replace

import pytest

from iveg.domain.margins import LeastMargins, SafetyMargin
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


def margins(scene: Scene) -> LeastMargins:
    return LeastMargins(scene.world.robots.values(), scene.everyone, at(scene.now))


def margin(scene: Scene) -> SafetyMargin:
    found = margins(scene).of_robot("AGI")
    assert found is not None
    return found


def pairs(scene: Scene) -> list[SafetyMargin]:
    """The margin of each robot with each sighting of each, each computed alone."""
    found = [
        LeastMargins([robot], [replace(one, sightings=(look,))], at(scene.now))
        for robot in scene.world.robots.values()
        for one in scene.everyone
        for look in one.sightings
    ]
    margins = (one.of_robot(name) for one in found for name in scene.robots)
    return [one for one in margins if one is not None]


def test_a_standing_robot_needs_what_the_person_may_walk_and_old_data_more() -> None:
    assert margin(met(linear=0.0)).needs_m == pytest.approx(1.6 * 0.79 + 0.40)

    fresh, old = margin(met(linear=0.5)), margin(met(linear=0.5, looked_s=1.4))
    assert old.age_s == pytest.approx(1.4)
    assert old.needs_m - fresh.needs_m == pytest.approx(
        (1.6 + 0.5) * (1.4 + 0.29 - 0.79)
    )


def test_of_who_was_not_seen_for_ten_seconds_there_is_no_margin() -> None:
    scene = met(looked_s=10.1)
    scene.drive("AGI", 0.0)

    assert margins(scene).of_robot("AGI") is None


@pytest.mark.parametrize(
    ("left", "band"),
    [(1.0, "clear"), (0.999, "tight"), (0.0, "tight"), (-0.001, "inside")],
)
def test_the_bands_have_their_borders(left: float, band: str) -> None:
    one = margin(met(linear=0.0))

    assert replace(one, gap_m=one.needs_m + left + 1e-12).band == band


def test_13_8_who_was_out_of_sight_for_long_has_a_margin_only_from_afar() -> None:
    for distance, last in ((10.0, "unknown"), (60.0, "clear")):
        scene, bands = met(distance, linear=0.5), list[str]()
        for scene.now in (1.4, 1.6, 9.0):
            scene.drive("AGI", 0.0, linear=0.5)
            bands.append(margin(scene).band)

        assert bands == ["clear", "clear", last]


def test_all_pairs_at_once_are_the_pairs_one_by_one() -> None:
    scene = Scene()
    for number, robot_id in enumerate(("AGI", "AGII")):
        scene.drive(robot_id, 9.0 * number, linear=0.3 + number)
        scene.look(robot_id, *(person(2.5 + 3.0 * each + number) for each in range(3)))
    scene.now = 1.2
    scene.drive("AGII", 8.0, linear=0.4)
    rank = {"inside": 0, "unknown": 1, "tight": 2, "clear": 2}
    for scene.now in (1.2, 2.9):
        ranked = sorted(pairs(scene), key=lambda one: (rank[one.band], one.margin_m))

        assert len(scene.everyone) > 1
        for robot_id in scene.robots:
            mine = [one for one in ranked if one.robot_id == robot_id]
            assert margins(scene).of_robot(robot_id) == mine[0]
