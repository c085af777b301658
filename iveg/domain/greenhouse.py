"""The greenhouse that robots drive in, for emulator, occlusion and map alike."""

from dataclasses import dataclass

from iveg.domain.geometry import Pose2D, Rectangle

OUTSIDE_M = 2.0
"""Distance outside the wall at which robots may be, by default (m)."""


@dataclass(frozen=True, slots=True)
class DriveLane:
    """A corridor to drive in, with its label for people."""

    label: str
    area: Rectangle


@dataclass(frozen=True, slots=True)
class StructuralPost:
    """A round structural post (m)."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class PlacedObstacle:
    """A crate stack or a trolley."""

    kind: str
    area: Rectangle


@dataclass(frozen=True, slots=True)
class Greenhouse:
    """Everything in the greenhouse that does not move, in ``map`` (m).

    Attributes:
        name: Its name.
        bounds: The outer wall.
        lanes: Corridors of robots and people.
        rows: Crop rows, which block the view of cameras and lasers.
        posts: Structural posts.
        obstacles: Crate stacks and trolleys.
        starts: Poses at which the robots of a scenario may begin, in order.
        outside_m: Distance outside the wall at which robots may be, in a yard or by the
            error of the wall (m).
    """

    name: str
    bounds: Rectangle
    lanes: tuple[DriveLane, ...] = ()
    rows: tuple[Rectangle, ...] = ()
    posts: tuple[StructuralPost, ...] = ()
    obstacles: tuple[PlacedObstacle, ...] = ()
    starts: tuple[Pose2D, ...] = ()
    outside_m: float = OUTSIDE_M

    @property
    def robots_within(self) -> Rectangle:
        """Area in which robots may be."""
        out, bounds = self.outside_m, self.bounds
        return Rectangle(
            bounds.xmin - out, bounds.ymin - out, bounds.xmax + out, bounds.ymax + out
        )

    def in_sight(self, ax: float, ay: float, bx: float, by: float) -> bool:
        """Whether no crop row stands between two points."""
        return not any(row.crosses(ax, ay, bx, by) for row in self.rows)

    def lane_at(self, x: float, y: float) -> str | None:
        """Label of the lane that contains a point; None: no lane does."""
        return next(
            (lane.label for lane in self.lanes if lane.area.contains(x, y)), None
        )
