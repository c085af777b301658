"""Ways on foot go round the crop and are no longer than they must be."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.tracking.ways import Ways

HALL = Rectangle(0, 0, 20, 20)
AISLES = Ways(
    Greenhouse("aisles", HALL, rows=(Rectangle(9, 5, 11, 20), Rectangle(4, 0, 5, 15)))
)
place = st.tuples(st.floats(0.5, 19.5), st.floats(0.5, 19.5))


def test_who_is_in_sight_is_reached_straight() -> None:
    assert AISLES.between(6.0, 6.0, 8.0, 9.0) == math.hypot(2.0, 3.0)


def test_the_way_to_the_next_aisle_bends_at_the_end_of_the_row() -> None:
    # Round (8.7, 4.7) and (11.3, 4.7): half a metre beside each side, then along.
    aside = math.hypot(0.3, 10.3)

    assert AISLES.between(8.4, 15.0, 11.6, 15.0) == pytest.approx(2 * aside + 2.6)


def test_who_leans_into_a_row_is_on_the_nearer_side_of_it() -> None:
    assert AISLES.between(9.1, 15.0, 8.0, 15.0) == pytest.approx(1.1)
    assert AISLES.between(9.1, 15.0, 11.5, 15.0) > 20.0


def test_there_is_no_way_through_a_row_from_wall_to_wall() -> None:
    halved = Ways(Greenhouse("halved", HALL, rows=(Rectangle(9, 0, 11, 20),)))

    assert halved.between(5.0, 5.0, 15.0, 5.0) == math.inf


def test_without_a_plan_of_the_crop_ways_are_straight() -> None:
    rows = tuple(Rectangle(x, 1, x + 0.1, 19) for x in range(1, 19))
    many = tuple(
        Rectangle(x / 10, y, x / 10 + 0.05, y + 0.5)
        for x in range(10, 190)
        for y in (5, 10)
    )

    assert Ways(Greenhouse("bare", HALL)).between(0.0, 0.0, 3.0, 4.0) == 5.0
    assert Ways(Greenhouse("rows", HALL, rows=rows)).between(0.5, 5, 19.5, 5) > 19.0
    assert Ways(Greenhouse("many", HALL, rows=many)).between(0.5, 5, 19.5, 5) == 19.0


@given(place, place, place)
def test_ways_are_a_distance(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]
) -> None:
    there = AISLES.between(*a, *b)

    assert there >= math.dist(a, b) - 1e-9
    assert there == pytest.approx(AISLES.between(*b, *a))
    # A corner is passed at 0.3 m, so a bend at ``c`` may save that much each time.
    assert there <= AISLES.between(*a, *c) + AISLES.between(*c, *b) + 2.0
