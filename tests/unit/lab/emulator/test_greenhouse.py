"""Rays meet what is there, and plants lean out of their rows."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse, PlacedObstacle, StructuralPost
from iveg.lab.emulator.greenhouse import Body, Disc, LaserModel, Scenery, sweep

GREENHOUSE = Greenhouse(
    "shed",
    Rectangle(0.0, 0.0, 10.0, 10.0),
    rows=(Rectangle(4.0, 0.0, 5.0, 8.0),),
    posts=(StructuralPost(7.0, 7.0, 0.1),),
    obstacles=(PlacedObstacle("crates", Rectangle(8.0, 1.0, 9.0, 2.0)),),
)
SCENERY = Scenery.from_greenhouse(GREENHOUSE)


def robot(x: float, y: float, yaw: float = 0.0, robot_id: str = "AGI") -> Body:
    return Body(robot_id, Pose2D(x, y, yaw), length=1.0, width=0.6)


def test_crop_and_crates_hide_what_is_behind_them() -> None:
    assert SCENERY.hides(2.0, 5.0, 6.0, 5.0)
    assert SCENERY.hides(7.5, 1.5, 9.5, 1.5)
    assert not SCENERY.hides(2.0, 9.0, 6.0, 9.0)


EXACT = LaserModel(beams=720, noise=0.0)
ROOM = Greenhouse("room", Rectangle(-10.0, -5.0, 10.0, 5.0))


def swept(
    sensor: Pose2D,
    greenhouse: Greenhouse = ROOM,
    *,
    people: Sequence[Disc] = (),
    others: Sequence[Body] = (),
    model: LaserModel = EXACT,
) -> NDArray[np.float32]:
    scenery = Scenery.from_greenhouse(greenhouse)
    return sweep(sensor, model, scenery, people, others, np.random.default_rng(1))


def towards(angle: float) -> int:
    """The beam at an angle (rad) of the sensor's frame."""
    return round((angle + math.pi) / EXACT.angle_increment) % EXACT.beams


def test_the_walls_of_a_room_stand_where_they_stand() -> None:
    ranges = swept(Pose2D(2.0, 1.0, 0.0))

    assert ranges[towards(0.0)] == pytest.approx(8.0)
    assert ranges[towards(math.pi / 2)] == pytest.approx(4.0)
    assert ranges[towards(-math.pi)] == pytest.approx(12.0)
    assert ranges[towards(-math.pi / 2)] == pytest.approx(6.0)
    assert ranges[towards(math.pi / 4)] == pytest.approx(4.0 * math.sqrt(2), abs=6e-4)


@given(
    x=st.floats(-8.0, 8.0),
    y=st.floats(-4.0, 4.0),
    yaw=st.floats(-math.pi, math.pi),
    angle=st.floats(0.0, math.tau),
)
def test_every_return_lies_on_the_person_or_on_the_wall(
    x: float, y: float, yaw: float, angle: float
) -> None:
    person = Disc(x + math.cos(angle), y + math.sin(angle), 0.25)
    ranges = swept(Pose2D(x, y, yaw), people=[person]).astype(float)
    angles = yaw - math.pi + EXACT.angle_increment * np.arange(EXACT.beams)

    px, py = x + ranges * np.cos(angles), y + ranges * np.sin(angles)
    on_person = np.abs(np.hypot(px - person.x, py - person.y) - 0.25) < 1e-3
    on_wall = np.minimum(10.0 - np.abs(px), 5.0 - np.abs(py)) < 1e-3

    assert (on_person | on_wall).all()
    assert on_person.sum() >= 50
