"""Greenhouse files: TOML in, a checked ``Greenhouse`` out.

An unusable file is refused with key and reason, so that a grower who measured a
greenhouse can correct the file without reading this code.
"""

from collections.abc import Sequence
from typing import Annotated, Self

from pydantic import Field, model_validator

from iveg.adapters.toml_files import Table, complaint, read_table, read_text
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import (
    OUTSIDE_M,
    DriveLane,
    Greenhouse,
    PlacedObstacle,
    StructuralPost,
)

BUILT_IN = ("mvsim-20x20", "agroconnect", "none")
_FARTHEST_M = 1e6


def load_greenhouse(name_or_file: str) -> Greenhouse:
    """Load one of ``BUILT_IN`` by name, or a file by its path.

    Raises:
        DataFileError: no such greenhouse, or an unusable file.
    """
    built_in = {name: f"greenhouses/{name}.toml" for name in BUILT_IN}
    return read_greenhouse(read_text(name_or_file, built_in), name_or_file)


def read_greenhouse(text: str, file: str) -> Greenhouse:
    """Read a greenhouse from TOML; ``file`` is its name in complaints.

    Raises:
        DataFileError: naming file, key and reason.
    """
    page = read_table(text, file, _FileTable)
    bounds = page.bounds.area()
    for name in ("lanes", "rows", "posts", "obstacles", "starts"):
        items: Sequence[_Area | _Point] = getattr(page, name)
        for index, item in enumerate(items):
            # Most typing errors lie outside the outer wall.
            if not all(bounds.contains(x, y) for x, y in item.corners()):
                raise complaint(file, (name, index), "lies outside bounds")
    return Greenhouse(
        page.name,
        bounds,
        tuple(DriveLane(lane.label, lane.area()) for lane in page.lanes),
        tuple(row.area() for row in page.rows),
        tuple(StructuralPost(post.x, post.y, post.radius) for post in page.posts),
        tuple(PlacedObstacle(row.kind, row.area()) for row in page.obstacles),
        tuple(Pose2D(start.x, start.y, start.yaw) for start in page.starts),
        page.outside_m,
    )


# --- the shape of the file --------------------------------------------------------

_Number = Annotated[float, Field(ge=-_FARTHEST_M, le=_FARTHEST_M)]
_Text = Annotated[str, Field(min_length=1, max_length=64, pattern=r"\S")]
_Corners = Sequence[tuple[float, float]]


class _Area(Table):
    xmin: _Number
    ymin: _Number
    xmax: _Number
    ymax: _Number

    @model_validator(mode="after")
    def _not_inside_out(self) -> Self:
        for low, high in (("xmin", "xmax"), ("ymin", "ymax")):
            if not getattr(self, low) < getattr(self, high):
                raise ValueError(f"{low} must be less than {high}")
        return self

    def area(self) -> Rectangle:
        return Rectangle(self.xmin, self.ymin, self.xmax, self.ymax)

    def corners(self) -> _Corners:
        return (self.xmin, self.ymin), (self.xmax, self.ymax)


class _Lane(_Area):
    label: _Text


class _Obstacle(_Area):
    kind: _Text


class _Point(Table):
    x: _Number
    y: _Number

    def corners(self) -> _Corners:
        return ((self.x, self.y),)


class _Post(_Point):
    radius: Annotated[float, Field(ge=0.001, le=_FARTHEST_M)]


class _Start(_Point):
    yaw: _Number


class _FileTable(Table):
    name: _Text
    bounds: _Area
    outside_m: Annotated[float, Field(ge=0.0, le=_FARTHEST_M)] = OUTSIDE_M
    lanes: list[_Lane] = Field(default_factory=list)
    rows: list[_Area] = Field(default_factory=list)
    posts: list[_Post] = Field(default_factory=list)
    obstacles: list[_Obstacle] = Field(default_factory=list)
    starts: list[_Start] = Field(default_factory=list)
