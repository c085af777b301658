"""Places in ``map``: points, boxes, the greenhouse and the costmap (m)."""

from dataclasses import asdict

from pydantic import Field

from iveg.domain.greenhouse import Greenhouse
from iveg.models.base import Model


class Point(Model):
    """A place in ``map`` (m)."""

    x: float
    y: float


class Position(Model):
    """A place in ``map`` with its height (m)."""

    x: float
    y: float
    z: float


class Area(Model):
    """A rectangle along the axes of ``map`` (m)."""

    xmin: float
    ymin: float
    xmax: float
    ymax: float


class Lane(Area):
    """A lane of the greenhouse."""

    label: str


class Obstacle(Area):
    """An obstacle."""

    kind: str


class Post(Model):
    """A round thing (m)."""

    x: float
    y: float
    radius: float


class GreenhouseMap(Model):
    """The greenhouse as the page draws it."""

    name: str
    bounds: Area
    lanes: list[Lane]
    rows: list[Area]
    posts: list[Post]
    obstacles: list[Obstacle]

    @classmethod
    def of(cls, greenhouse: Greenhouse) -> "GreenhouseMap":
        """The greenhouse that is supervised."""
        return cls(
            name=greenhouse.name,
            bounds=Area(**asdict(greenhouse.bounds)),
            lanes=[
                Lane(label=lane.label, **asdict(lane.area)) for lane in greenhouse.lanes
            ],
            rows=[Area(**asdict(row)) for row in greenhouse.rows],
            posts=[Post(**asdict(post)) for post in greenhouse.posts],
            obstacles=[
                Obstacle(kind=one.kind, **asdict(one.area))
                for one in greenhouse.obstacles
            ],
        )


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
