import math

import pytest

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse, PlacedObstacle, StructuralPost
from iveg.lab.emulator.greenhouse import Body, Scenery
from tests.touching import bodies_touch, touches

GREENHOUSE = Greenhouse(
    "shed",
    Rectangle(0.0, 0.0, 10.0, 10.0),
    rows=(Rectangle(4.0, 0.0, 5.0, 8.0),),
    posts=(StructuralPost(7.0, 7.0, 0.1),),
    obstacles=(PlacedObstacle("crates", Rectangle(8.0, 1.0, 9.0, 2.0)),),
)
SCENERY = Scenery.of(GREENHOUSE)


def robot(x: float, y: float, yaw: float = 0.0, robot_id: str = "AGI") -> Body:
    return Body(robot_id, Pose2D(x, y, yaw), length=1.0, width=0.6)


@pytest.mark.parametrize(
    "body",
    [
        robot(3.6, 4.0),
        robot(8.5, 2.2),
        robot(7.0, 7.3),
        robot(0.4, 5.0),
        robot(3.45, 4.0, math.radians(45)),
    ],
)
def test_a_robot_in_crop_crates_post_or_wall_touches(body: Body) -> None:
    assert touches(SCENERY, body)


@pytest.mark.parametrize(
    "body", [robot(2.0, 5.0), robot(3.45, 4.0), robot(7.0, 7.5), robot(4.5, 9.0)]
)
def test_a_robot_in_the_open_touches_nothing(body: Body) -> None:
    assert not touches(SCENERY, body)


def test_crop_and_crates_hide_what_is_behind_them() -> None:
    assert SCENERY.hides(2.0, 5.0, 6.0, 5.0)
    assert SCENERY.hides(7.5, 1.5, 9.5, 1.5)
    assert not SCENERY.hides(2.0, 9.0, 6.0, 9.0)


def test_a_place_is_free_with_room_for_the_radius() -> None:
    assert SCENERY.free(3.7, 4.0, 0.25)
    assert not SCENERY.free(3.8, 4.0, 0.25)
    assert not SCENERY.free(0.2, 5.0, 0.25)


def test_the_gap_to_a_robot_is_measured_from_its_side() -> None:
    gap, out_x, out_y = robot(2.0, 2.0, math.pi / 2).gap_to(2.8, 2.0)

    assert gap == pytest.approx(0.5)
    assert (out_x, out_y) == pytest.approx((1.0, 0.0))


def test_somebody_inside_a_robot_has_no_gap_and_a_way_out() -> None:
    gap, out_x, out_y = robot(2.0, 2.0).gap_to(2.1, 2.1)

    assert gap == 0.0
    assert (out_x, out_y) == pytest.approx((0.0, 1.0))


def test_two_robots_touch_when_their_corners_do() -> None:
    turned = robot(2.0, 2.8, math.radians(45), "AGII")

    assert bodies_touch([robot(2.0, 2.0), turned])
    assert not bodies_touch([robot(2.0, 2.0), robot(2.0, 2.7, 0.0, "AGII")])
