import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from iveg.domain.geometry import Box3D
from iveg.robot.grounding import (
    DepthPicture,
    Grounding,
    Mask,
    Pinhole,
    Segment,
    cloud_index,
    eroded,
    ground,
    kernel_area,
    kernel_size,
    top_left,
)

LENS = Pinhole(40, 30, 20.0, 19.5, 14.5)


def picture(depth: float = 2.0) -> NDArray[np.float32]:
    return np.full((LENS.height, LENS.width), depth, np.float32)


def segment(
    mask: Mask | None = None, *, left: int = 10, top: int = 5, probability: float = 0.9
) -> Segment:
    body = np.ones((8, 6), np.bool_) if mask is None else mask
    height, width = body.shape
    centre = left + width / 2, top + height / 2
    return Segment("farmer", probability, *centre, body)


def refusal(seen: Segment, depth: NDArray[np.float32]) -> str:
    answer = ground(seen, DepthPicture(LENS, depth), Grounding(iterations=0, rim=0))
    assert isinstance(answer, str)
    return answer


def drawn(picture: str) -> Mask:
    rows = picture.split()
    return np.array([[cell == "#" for cell in row] for row in rows])


# --- kernel and erosion ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("factor", "area"), [(0.0, 49.0), (50.0, 24.5), (90.0, 9.0), (100.0, 9.0)]
)
def test_the_printed_kernel_shrinks_to_its_least_as_the_factor_grows(
    factor: float, area: float
) -> None:
    assert kernel_area(factor, 9.0, 49.0) == area


@pytest.mark.parametrize(("area", "edge"), [(0.0, 1), (8.9, 2), (9.0, 3), (24.5, 4)])
def test_the_cross_is_as_wide_as_the_floor_of_the_areas_root(
    area: float, edge: int
) -> None:
    assert kernel_size(area) == edge


def test_the_formula_as_printed_would_keep_the_stalk_and_lose_the_body() -> None:
    mask = drawn(".........  .#####...  .########  .#####...  .#####...  .........")
    body = drawn(".........  ..####...  .######..  .#####...  ..###....  .........")

    opened = eroded(mask, 3, 1)
    printed = mask & ~opened

    np.testing.assert_array_equal(opened, body)
    assert printed[2, 7:].all()
    assert not printed[2, 2:6].any()


# --- cloud index and filter -----------------------------------------------------------


@pytest.mark.parametrize(
    ("centre", "size", "corner"),
    [((13.0, 9.0), (6, 8), (10, 5)), ((12.5, 9.5), (5, 9), (10, 5))],
)
def test_the_corner_is_half_a_box_up_and_left_of_the_centre(
    centre: tuple[float, float], size: tuple[int, int], corner: tuple[int, int]
) -> None:
    assert top_left(*centre, *size) == corner


def test_a_pixel_of_the_mask_finds_its_point_in_the_cloud() -> None:
    mask = drawn("..  .#")

    assert cloud_index(mask, (10, 5), LENS).tolist() == [(1 + 5) * 40 + (1 + 10)]


@pytest.mark.parametrize(("jump", "accepted"), [(0.25, True), (0.2501, False)])
def test_a_depth_may_differ_from_its_left_neighbour_by_the_bound_and_no_more(
    jump: float, accepted: bool
) -> None:
    depth = picture(2.0)
    depth[5, 10:] = 2.0 + jump

    first_column, index = 5 * 40, 5 * 40 + 10
    found = DepthPicture(LENS, depth).continuous(np.array([first_column, index]), 0.25)

    assert found.tolist() == [False, accepted]


@pytest.mark.parametrize("hole", [0.0, -1.0, math.nan, math.inf, -math.inf])
def test_a_hole_is_never_accepted_and_vouches_for_nobody(hole: float) -> None:
    depth = picture()
    depth[5, 10] = hole
    around = np.array([5 * 40 + 9, 5 * 40 + 10, 5 * 40 + 11])

    found = DepthPicture(LENS, depth).continuous(around, math.inf)

    assert found.tolist() == [True, False, False]


# --- box ------------------------------------------------------------------------------


@pytest.mark.parametrize(("probability", "taken"), [(0.8, True), (0.7999999, False)])
def test_the_least_probability_is_inclusive(probability: float, taken: bool) -> None:
    answer = ground(segment(probability=probability), DepthPicture(LENS, picture()))

    assert isinstance(answer, Box3D) is taken


def test_a_target_without_a_place_says_why() -> None:
    nothing = np.zeros((8, 6), np.bool_)

    assert refusal(segment(probability=0.5), picture()) == "unsure"
    assert refusal(segment(nothing), picture()) == "empty"
    assert refusal(segment(left=60), picture()) == "empty"
    assert refusal(segment(), picture(0.0)) == "no_depth"


# --- a recorded picture ---------------------------------------------------------------

RECORDED = Pinhole(56, 156, 232.80144458759122, 39.5, 99.5)
"""AGI's depth camera, 320 × 240, about a person 3 m ahead and 0.15 m to its left."""
TRUE_PLACE = (3.4, 0.15, 0.875)


@pytest.mark.parametrize("name", ["clear", "leafy"])
def test_a_person_in_a_picture_is_placed_within_a_quarter_metre(name: str) -> None:
    file = Path(__file__).parents[2] / "data" / "person_in_leaves.npz"
    with np.load(file) as kept:
        mask, depth = kept[f"{name}_mask"], kept[f"{name}_depth_mm"]
    seen = DepthPicture(RECORDED, depth.astype(np.float32) / 1000)
    height, width = mask.shape

    found = ground(Segment("farmer", 0.9, width / 2, height / 2, mask), seen)

    assert isinstance(found, Box3D)
    right, down, ahead = found.centre
    miss = np.subtract((0.4 + ahead, -right, 0.6 - down), TRUE_PLACE)
    assert np.hypot(*miss[:2]) < 0.25
    assert abs(miss[2]) < 0.05
