"""What lasers and cameras have mapped: scans, the costmap, covered aisles (m)."""

from pydantic import Field

from iveg.models.base import Model
from iveg.models.places import Area, Point


class Scan(Model):
    """One sweep: points in ``map`` (m)."""

    robot_id: str
    stamp: str | None
    frame_id: str = "map"
    points: list[tuple[float, float]]


class Costmap(Model):
    """Cells from the south-western corner, row by row: 0-100, -1 unknown."""

    resolution: float = Field(description="Metres a cell.")
    width: int
    height: int
    origin: Point
    data: list[int]
    age_s: float | None = Field(
        default=None, description="Since the newest scan in it; null before the first."
    )


class LaneCoverage(Area):
    """One aisle in cells: rows from the south, each from west to east."""

    label: str
    columns: int
    rows: int
    ages_s: list[int | None] = Field(
        description="Whole seconds since a camera last covered a cell; null: never."
    )


class Coverage(Model):
    """When a camera last looked at each cell of the aisles."""

    at: str
    cameras: int = Field(description="Number of working cameras.")
    within_s: float
    share: float | None = Field(
        description=(
            "Share of the cells covered within that time (0-1); null without aisles."
        )
    )
    lanes: list[LaneCoverage]
