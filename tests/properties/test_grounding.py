"""Laws of grounding that hold for every mask and every depth picture."""

import math
from dataclasses import astuple

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
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
)

LENS = Pinhole(48, 32, 40.0, 23.5, 15.5)
seeds = st.integers(0, 2**32 - 1)
shares = st.sampled_from((0.0, 0.1, 0.5, 0.9, 1.0))
edges = st.integers(1, 20)
crosses = st.integers(1, 8)


@st.composite
def masks(draw: st.DrawFn) -> Mask:
    """Noise with a solid part, so that erosion leaves something now and then."""
    rng = np.random.default_rng(draw(seeds))
    height, width = draw(edges), draw(edges)
    mask = rng.random((height, width)) < draw(shares)
    mask[height // 4 : height - height // 4, width // 4 : width - width // 4] = True
    return mask


@st.composite
def depths(draw: st.DrawFn) -> NDArray[np.float32]:
    """A rough surface with holes of every kind."""
    rng = np.random.default_rng(draw(seeds))
    depth = 3.0 + 0.05 * rng.normal(size=(LENS.height, LENS.width))
    holes = rng.random(depth.shape) < 0.1
    depth[holes] = rng.choice([0.0, -1.0, math.nan, math.inf], int(holes.sum()))
    return depth.astype(np.float32)


def segment(mask: Mask, left: int, top: int) -> Segment:
    height, width = mask.shape
    return Segment(
        "farmer",
        0.9,
        left + width / 2,
        top + height / 2,
        mask,
    )


@given(masks(), crosses, st.integers(0, 5), st.integers(0, 5))
def test_erosion_never_grows_a_mask_and_never_empties_one(
    mask: Mask, size: int, iterations: int, rim: int
) -> None:
    body = eroded(mask, size, iterations, rim)

    assert not (body & ~mask).any()
    assert body.any() == mask.any()


@given(masks(), crosses, st.integers(1, 4))
def test_opening_an_opened_mask_again_changes_nothing(
    mask: Mask, size: int, iterations: int
) -> None:
    opened = eroded(mask, size, iterations)

    again = eroded(opened, size, iterations)

    np.testing.assert_array_equal(opened, again)


@given(masks(), crosses, st.integers(1, 4), st.integers(1, 4))
def test_a_wider_rim_keeps_less(
    mask: Mask, size: int, iterations: int, rim: int
) -> None:
    narrow, wide = (eroded(mask, size, iterations, keep) for keep in (rim - 1, rim))

    assert not (wide & ~narrow).any()


@given(masks(), crosses, st.integers(0, 7), st.integers(0, 7), st.integers(0, 4))
def test_erosion_does_not_care_where_the_mask_stands(
    mask: Mask, size: int, down: int, right: int, rim: int
) -> None:
    moved = np.pad(mask, ((down, 3), (right, 3)))

    there = eroded(moved, size, 3, rim)[down:-3, right:-3]

    np.testing.assert_array_equal(there, eroded(mask, size, 3, rim))


@given(st.floats(0, 100), st.floats(0, 100), st.floats(1, 50), st.floats(1, 900))
def test_the_kernel_never_grows_with_the_factor_nor_falls_below_its_least(
    one: float, other: float, least: float, most: float
) -> None:
    smaller, larger = sorted((one, other))

    spared = kernel_area(larger, least, most)

    assert least <= spared <= kernel_area(smaller, least, most)


@settings(max_examples=50)
@given(masks(), depths(), st.integers(-10, 50), st.integers(-10, 35))
def test_eroding_and_filtering_may_be_done_in_either_order(
    mask: Mask, depth: NDArray[np.float32], left: int, top: int
) -> None:
    picture = DepthPicture(LENS, depth)
    everything, body = (
        cloud_index(some, (left, top), LENS) for some in (mask, eroded(mask, 3, 2, 1))
    )

    filtered_first = np.intersect1d(
        everything[picture.continuous(everything, 0.1)], body
    )

    np.testing.assert_array_equal(filtered_first, body[picture.continuous(body, 0.1)])


@settings(max_examples=50)
@given(masks(), depths(), st.integers(-10, 50), st.integers(-10, 35))
def test_the_box_holds_every_accepted_point_and_touches_its_extremes(
    mask: Mask, depth: NDArray[np.float32], left: int, top: int
) -> None:
    picture = DepthPicture(LENS, depth)
    open_handed = Grounding(iterations=0, rim=0, most_jump=0.1)
    index = cloud_index(mask, (left, top), LENS)
    points = picture.points(index[picture.continuous(index, 0.1)])

    found = ground(segment(mask, left, top), picture, open_handed)

    assert isinstance(found, Box3D) == bool(len(points))
    for box in [found] if isinstance(found, Box3D) else []:
        assert [box.xmin, box.ymin, box.zmin] == points.min(axis=0).tolist()
        assert [box.xmax, box.ymax, box.zmax] == points.max(axis=0).tolist()
        assert box.zmin > 0.0


@settings(max_examples=50)
@given(st.integers(1, 20), st.integers(0, 12), st.integers(0, 20), st.integers(0, 12))
def test_a_target_moved_across_the_picture_moves_by_that_many_pixels_in_metres(
    left: int, top: int, right: int, down: int
) -> None:
    mask = np.ones((8, 7), np.bool_)
    flat = DepthPicture(LENS, np.full((LENS.height, LENS.width), 2.0, np.float32))
    unmoved, moved = (
        ground(segment(mask, x, y), flat)
        for x, y in ((left, top), (left + right, top + down))
    )

    assert isinstance(unmoved, Box3D)
    assert isinstance(moved, Box3D)
    shift = np.subtract(moved.centre, unmoved.centre)
    np.testing.assert_allclose(shift, (right / 20, down / 20, 0.0), atol=1e-9)
    low, high = (
        np.subtract(astuple(moved)[side::2], astuple(unmoved)[side::2])
        for side in (0, 1)
    )
    np.testing.assert_allclose(high, low, atol=1e-9)
