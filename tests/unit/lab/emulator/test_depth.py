import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse, StructuralPost
from iveg.lab.emulator.depth import (
    DepthView,
    Upright,
    person_shape,
    robot_shape,
    take_picture,
)
from iveg.lab.emulator.depth_camera import DepthCamera
from iveg.lab.emulator.foliage import Foliage
from iveg.lab.emulator.greenhouse import Body, Disc, Scenery
from iveg.robot.grounding.cloud import DepthPicture, Pinhole
from iveg.robot.grounding.locate import (
    DEFAULT,
    Grounded,
    Grounding,
    Mount,
    Segment,
    ground,
    to_detection,
)
from iveg.robot.grounding.mask import read_mask
from tests.builders import AGI, AGII

BOUNDS = Rectangle(-20.0, -20.0, 20.0, 20.0)
OPEN = Scenery.of(Greenhouse("yard", BOUNDS))
AISLE = Scenery.of(
    Greenhouse(
        "aisle",
        BOUNDS,
        rows=(
            Rectangle(-2.0, 1.2, 12.0, 1.8),
            Rectangle(-2.0, -1.8, 12.0, -1.2),
            Rectangle(8.0, -1.0, 8.6, 1.0),
        ),
    )
)
"""Crop to both sides, and across behind whoever stands in between."""

HERE = Pose2D(0.0, 0.0, 0.0)
SHARP = DepthCamera(
    Pinhole.across(AGI.camera_fov), 0.6, 30.0, disparity_error=0.0, dropouts=0.0
)
MIDDLE = 320
HORIZON = 240

DISTANCES_M = (1.5, 2.0, 3.0, 4.5, 6.0)
PICTURES = 5
BASELINES_M = {AGI: 0.05, AGII: 0.12}
OPEN_HANDED = Grounding(iterations=0, rim=0, most_jump=math.inf)
ERODED_ONLY = Grounding(most_jump=math.inf)
OPENED_ONLY = Grounding(rim=0)
WHOLE = Grounding(hidden={"farmer": 0.36})


def view(
    *targets: tuple[Upright, ...],
    camera: DepthCamera = SHARP,
    sensor: Pose2D = HERE,
    scenery: Scenery = OPEN,
    foliage: Foliage | None = None,
    seed: int = 1,
) -> DepthView:
    rng = np.random.default_rng(seed)
    return take_picture(camera, sensor, targets, scenery, foliage, rng)


def segment(picture: DepthView, number: int = 1, class_id: str = "farmer") -> Segment:
    seen = picture.segment(number, class_id, 0.9)
    assert seen is not None
    return seen


@dataclass(frozen=True, slots=True)
class Trial:
    """A person in the aisle, ``ahead`` of a robot's camera and ``left`` of it (m)."""

    profile: RobotProfile
    ahead: float
    left: float
    seed: int

    def miss(
        self, settings: Grounding, foliage: Foliage | None
    ) -> tuple[float, float, float]:
        """Centre found less the true one, in ``base_link`` (m)."""
        camera = DepthCamera.of(self.profile, BASELINES_M[self.profile])
        sensor = self.profile.camera
        person = Disc(sensor.x + self.ahead, self.left, 0.25)
        seen = view(
            person_shape(person),
            camera=camera,
            sensor=sensor,
            scenery=AISLE,
            foliage=foliage,
            seed=self.seed,
        )
        found = ground(segment(seen), seen.depth, settings)
        assert isinstance(found, Grounded)
        x, y, z = to_detection(found, Mount.of(self.profile)).box.centre
        return x - person.x, y - person.y, z - 0.875


def trials(profile: RobotProfile, ahead: float) -> list[Trial]:
    return [
        Trial(profile, ahead, 0.15 * (seed % 3 - 1), seed) for seed in range(PICTURES)
    ]


def misses(
    profile: RobotProfile,
    ahead: float,
    settings: Grounding = DEFAULT,
    foliage: Foliage | None = None,
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Shape (PICTURES, 3)."""
    return np.array([one.miss(settings, foliage) for one in trials(profile, ahead)])


def mean_shift(profile: RobotProfile, ahead: float, settings: Grounding) -> float:
    """How far leaves move the centre over the floor, on average (m)."""
    clear = misses(profile, ahead, settings)
    leafy = misses(profile, ahead, settings, Foliage())
    return float(np.hypot(*(leafy - clear).T[:2]).mean())


# --- the picture ----------------------------------------------------------------------


def test_a_person_is_as_deep_as_the_near_side_and_as_tall_as_a_person() -> None:
    seen = view(person_shape(Disc(4.0, 0.0, 0.25)))
    rows, columns = np.nonzero(seen.instances == 1)
    metre = SHARP.lens.focal

    assert seen.depth.depth[HORIZON, MIDDLE] == pytest.approx(3.75, abs=1e-3)
    across, above, below = 0.5 / math.sqrt(4.0**2 - 0.25**2), 1.15 / 3.9, 0.6 / 3.75
    assert np.ptp(columns) == pytest.approx(across * metre, abs=2)
    assert np.ptp(rows) == pytest.approx((above + below) * metre, abs=2)


def test_left_of_the_camera_is_left_in_the_picture() -> None:
    seen = view(person_shape(Disc(4.0, 1.0, 0.25)))

    assert segment(seen).x_c == pytest.approx(MIDDLE - SHARP.lens.focal / 4, abs=5)


def test_depth_runs_along_the_optical_axis_not_along_the_ray() -> None:
    wall = view(scenery=Scenery.of(Greenhouse("w", Rectangle(-5.0, -9.0, 5.0, 9.0))))

    assert wall.depth.depth[HORIZON] == pytest.approx(5.0)


def test_a_turned_robot_shows_the_face_that_looks_at_the_camera() -> None:
    body = Body("AGII", Pose2D(4.0, 0.0, math.pi / 2), 1.4, 0.8)

    seen = view(robot_shape(body))

    assert seen.depth.depth[HORIZON, MIDDLE] == pytest.approx(3.6)
    assert segment(seen).width == pytest.approx(1.4 / 3.6 * SHARP.lens.focal, abs=1.5)


def test_a_turned_camera_sees_what_it_points_at() -> None:
    sensor = Pose2D(1.0, 2.0, math.pi / 2)

    seen = view(person_shape(Disc(1.0, 5.0, 0.25)), sensor=sensor)

    assert seen.instances[HORIZON, MIDDLE] == 1
    assert seen.depth.depth[HORIZON, MIDDLE] == pytest.approx(2.75, abs=1e-3)


def test_the_floor_is_below_and_the_wall_above() -> None:
    depth = view().depth.depth
    down = (479 - SHARP.lens.cy) / SHARP.lens.focal

    assert depth[479, MIDDLE] == pytest.approx(0.6 / down)
    assert depth[0, MIDDLE] == pytest.approx(20.0)


def test_the_near_hides_the_far_in_whatever_order_they_are_named() -> None:
    near, far = (person_shape(Disc(x, 0.0, 0.25)) for x in (2.0, 4.0))

    first, second = view(near, far), view(far, near)

    np.testing.assert_array_equal(first.depth.depth, second.depth.depth)
    assert first.instances[HORIZON, MIDDLE] == 1
    assert second.instances[HORIZON, MIDDLE] == 2


def test_who_is_behind_crop_or_behind_the_camera_has_no_segment() -> None:
    behind_crop, behind_camera = (
        person_shape(Disc(x, y, 0.25)) for x, y in ((5.0, 3.0), (-3.0, 0.0))
    )

    seen = view(behind_crop, behind_camera, scenery=AISLE)

    assert seen.segment(1, "farmer", 0.9) is None
    assert seen.segment(2, "farmer", 0.9) is None


def test_a_post_and_a_row_stand_in_the_picture() -> None:
    post = StructuralPost(3.0, 0.0, 0.1)
    greenhouse = Greenhouse("h", BOUNDS, (), (Rectangle(5.0, -3.0, 6.0, 3.0),), (post,))

    depth = view(scenery=Scenery.of(greenhouse)).depth.depth

    assert depth[HORIZON, MIDDLE] == pytest.approx(2.9, abs=1e-3)
    assert depth[HORIZON, MIDDLE + 60] == pytest.approx(5.0)


def test_a_segment_is_the_mask_cropped_to_its_box() -> None:
    seen = view(person_shape(Disc(4.0, 0.5, 0.25)))
    found = segment(seen)

    mask = read_mask(found.bits, found.width, found.height)
    left = round(found.x_c - found.width / 2)
    top = round(found.y_c - found.height / 2)
    window = seen.instances[top : top + found.height, left : left + found.width] == 1

    np.testing.assert_array_equal(mask, window)
    assert mask.sum() == (seen.instances == 1).sum()


# --- its errors -----------------------------------------------------------------------


def test_the_same_seed_takes_the_same_picture_and_another_seed_another() -> None:
    camera = DepthCamera.of(AGI)
    one, same, other = (view(camera=camera, seed=n).depth.depth for n in (1, 1, 2))

    np.testing.assert_array_equal(one, same)
    assert (one != other).any()


def test_nothing_is_measured_out_of_range() -> None:
    depth = view(camera=replace(SHARP, most=8.0)).depth.depth

    assert depth[HORIZON - 5, MIDDLE] == 0.0
    assert depth[479, MIDDLE] > 0.0


def test_depth_errs_with_the_square_of_the_distance() -> None:
    camera = replace(SHARP, disparity_error=0.08)
    wall = Scenery.of(Greenhouse("w", Rectangle(-4.0, -9.0, 4.0, 9.0)))
    error = 4.0**2 * 0.08 / (camera.lens.focal * 0.05)

    seen = view(camera=camera, scenery=wall).depth.depth[:HORIZON]

    assert seen.mean() == pytest.approx(4.0, abs=0.01)
    assert 0.5 * error < seen.std() < error


def test_some_pixels_are_not_measured() -> None:
    camera = replace(SHARP, dropouts=0.1)

    lost = view(camera=camera).depth.depth == 0.0

    assert lost.mean() == pytest.approx(0.1, abs=0.01)


def test_leaves_leak_into_the_mask_at_another_depth() -> None:
    person = person_shape(Disc(3.0, 0.0, 0.25))
    clear, leafy = view(person), view(person, foliage=Foliage())
    leaf = leafy.leaked == 1

    assert leaf.any()
    assert (leafy.depth.depth[leaf] > 3.0).all()
    assert (leafy.instances[leaf] == 0).all()
    assert segment(leafy).width > segment(clear).width


def test_leaves_before_a_person_hide_a_part() -> None:
    person = person_shape(Disc(3.0, 0.0, 0.25))
    clear, leafy = view(person), view(person, foliage=Foliage(before=1.0))

    assert (leafy.instances == 1).sum() < (clear.instances == 1).sum()


def test_nothing_grows_about_somebody_who_is_not_seen() -> None:
    seen = view(person_shape(Disc(-3.0, 0.0, 0.25)), foliage=Foliage())

    assert not seen.leaked.any()


# --- grounding against the truth ------------------------------------------------------

EVERYWHERE = [(profile, ahead) for profile in (AGI, AGII) for ahead in DISTANCES_M]


@pytest.mark.parametrize(("profile", "ahead"), EVERYWHERE)
def test_a_person_in_a_clear_aisle_is_placed_within_a_quarter_metre(
    profile: RobotProfile, ahead: float
) -> None:
    over_the_floor = np.hypot(*misses(profile, ahead).T[:2])

    assert over_the_floor.mean() < 0.25
    assert over_the_floor.max() < 0.30


@pytest.mark.parametrize(("profile", "ahead"), EVERYWHERE)
def test_the_hidden_half_known_a_person_is_placed_within_a_tenth(
    profile: RobotProfile, ahead: float
) -> None:
    assert np.hypot(*misses(profile, ahead, WHOLE).T[:2]).max() < 0.10


@pytest.mark.parametrize("ahead", [3.0, 4.5, 6.0])
def test_the_centre_is_at_half_height_where_all_of_a_person_is_in_the_picture(
    ahead: float,
) -> None:
    assert np.abs(misses(AGI, ahead)[:, 2]).max() < 0.05


@pytest.mark.parametrize(("profile", "ahead"), EVERYWHERE)
def test_foliage_moves_a_person_by_less_than_a_tenth(
    profile: RobotProfile, ahead: float
) -> None:
    assert mean_shift(profile, ahead, DEFAULT) < 0.10


@pytest.mark.parametrize("ahead", [1.5, 3.0, 6.0])
def test_without_erosion_and_filter_foliage_moves_a_person_by_more(
    ahead: float,
) -> None:
    assert mean_shift(AGI, ahead, OPEN_HANDED) > 0.20


@pytest.mark.parametrize("ahead", [1.5, 3.0, 6.0])
def test_the_opening_alone_is_not_enough(ahead: float) -> None:
    assert mean_shift(AGI, ahead, OPENED_ONLY) > 0.20


def test_the_depth_filter_keeps_single_pixels_at_a_wrong_depth_out_of_the_box() -> None:
    seen = view(person_shape(Disc(3.0, 0.0, 0.25)))
    speckled = seen.depth.depth.copy()
    speckled[HORIZON - 50 : HORIZON + 50 : 7, MIDDLE - 30 : MIDDLE + 30 : 9] = 6.0
    picture = DepthPicture(seen.depth.camera, speckled)

    kept = ground(segment(seen), picture)
    let_through = ground(segment(seen), picture, ERODED_ONLY)

    assert isinstance(kept, Grounded)
    assert isinstance(let_through, Grounded)
    assert kept.box.zmax < 3.0
    assert let_through.box.zmax == pytest.approx(6.0)
