import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse, StructuralPost
from iveg.lab.emulator.greenhouse import Body, Disc, Scenery
from iveg.lab.emulator.lidar import LaserModel, sweep

EXACT = LaserModel(beams=720, noise=0.0)
ROOM = Greenhouse("room", Rectangle(-10.0, -5.0, 10.0, 5.0))
FIELD = load_greenhouse("none")


def swept(
    sensor: Pose2D,
    greenhouse: Greenhouse = ROOM,
    *,
    people: Sequence[Disc] = (),
    others: Sequence[Body] = (),
    model: LaserModel = EXACT,
) -> NDArray[np.float32]:
    scenery = Scenery.of(greenhouse)
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


def test_turning_the_sensor_turns_the_beams() -> None:
    ranges = swept(Pose2D(2.0, 1.0, math.pi / 2))

    assert ranges[towards(0.0)] == pytest.approx(4.0)
    assert ranges[towards(-math.pi / 2)] == pytest.approx(8.0)


def test_a_row_of_crop_is_nearer_than_the_wall_behind_it() -> None:
    row = Rectangle(4.0, -2.0, 5.0, 2.0)
    greenhouse = Greenhouse("room", ROOM.bounds, rows=(row,))

    ranges = swept(Pose2D(0.0, 0.0, 0.0), greenhouse)

    assert ranges[towards(0.0)] == pytest.approx(4.0)
    assert ranges[towards(math.radians(26.0))] == pytest.approx(
        4.0 / math.cos(math.radians(26.0)), abs=6e-4
    )
    assert ranges[towards(math.radians(40.0))] > 5.0


def test_a_person_and_a_post_are_round() -> None:
    greenhouse = Greenhouse(
        "room", ROOM.bounds, posts=(StructuralPost(-3.0, 0.0, 0.1),)
    )

    ranges = swept(Pose2D(0.0, 0.0, 0.0), greenhouse, people=[Disc(3.0, 0.0, 0.25)])

    assert ranges[towards(0.0)] == pytest.approx(2.75)
    assert ranges[towards(-math.pi)] == pytest.approx(2.9)
    assert ranges[towards(math.radians(6.0))] == pytest.approx(
        10.0 / math.cos(math.radians(6.0)), abs=6e-4
    )


def test_another_robot_is_a_turned_rectangle() -> None:
    robot = Body("AGII", Pose2D(4.0, 0.0, math.pi / 2), length=1.4, width=0.8)

    ranges = swept(Pose2D(0.0, 0.0, 0.0), others=[robot])

    assert ranges[towards(0.0)] == pytest.approx(3.6)
    assert ranges[towards(math.atan2(0.6, 3.6))] < 3.7
    assert ranges[towards(math.atan2(0.9, 3.6))] > 5.0


def test_nothing_within_range_is_infinite() -> None:
    ranges = swept(Pose2D(0.0, 0.0, 0.0), FIELD)

    assert ranges.dtype == np.float32
    assert np.isinf(ranges).all()


def test_noise_is_as_small_as_the_data_sheet_says() -> None:
    exact = swept(Pose2D(0.0, 0.0, 0.3))
    noisy = swept(Pose2D(0.0, 0.0, 0.3), model=LaserModel())

    errors = noisy - exact
    assert 0.008 < errors.std() < 0.012
    assert abs(errors).max() < 0.05


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
