"""Parts of the aisles that nobody sees, and when somebody last looked there."""

from iveg.domain.coverage import MOST_CELLS, AisleCoverage
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import DriveLane, Greenhouse
from tests.builders import at
from tests.unit.domain.scene import Scene

AISLES = (
    DriveLane("1", Rectangle(0.0, -0.5, 12.0, 0.5)),
    DriveLane("2", Rectangle(0.0, 1.5, 12.0, 2.5)),
)
GREENHOUSE = Greenhouse(
    "two aisles",
    Rectangle(0.0, -3.0, 12.0, 3.0),
    lanes=AISLES,
    rows=(Rectangle(0.0, 0.9, 12.0, 1.1),),
)


def test_a_camera_sees_ahead_and_not_behind_or_through_the_crop_and_ages_grow() -> None:
    """AGI stands in the middle of aisle 1 and looks east."""
    scene, coverage = Scene(greenhouse=GREENHOUSE), AisleCoverage(GREENHOUSE)
    scene.drive("AGI", 4.0, linear=0.0)
    scene.look("AGI")
    coverage.update(scene.world.live_robots(), at(0.0))

    first, second = coverage.ages(at(3))
    assert first[:5] == [None] * 5
    assert first[6] == 3
    assert second == [None] * 12
    assert coverage.ages(at(11))[0][6] == 11
    assert (coverage.share(at(1)) or 0.0) > 0.0
    assert coverage.share(at(11)) == 0.0


def test_an_open_field_has_no_aisles_to_look_at() -> None:
    field = Greenhouse("field", Rectangle(-100, -100, 100, 100))

    assert AisleCoverage(field).share(at(0)) is None


def test_no_greenhouse_costs_more_than_a_bound() -> None:
    vast = DriveLane("1", Rectangle(0, 0, 500, 500))
    greenhouse = Greenhouse("vast", vast.area, lanes=(vast,))

    (cells,) = AisleCoverage(greenhouse).lanes

    assert cells.count <= 1.1 * MOST_CELLS
