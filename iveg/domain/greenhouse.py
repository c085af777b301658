"""The greenhouse that robots drive in, for emulator, occlusion and map alike."""

from dataclasses import dataclass

from iveg.domain.geometry import Pose2D, Rectangle

OUTSIDE_M = 2.0


@dataclass(frozen=True, slots=True)
class DriveLane:
    """A corridor to drive in, with the label that people know it by."""

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
        bounds: The outer wall.
        lanes: Where robots and people go.
        rows: Crop; hides what is behind it from cameras and lasers.
        outside_m: How far outside robots may be, on a yard or for the walls' error (m).
        starts: Where each robot of a scenario may begin, in order.
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
        """Where robots may be."""
        out, bounds = self.outside_m, self.bounds
        return Rectangle(
            bounds.xmin - out, bounds.ymin - out, bounds.xmax + out, bounds.ymax + out
        )

    def in_sight(self, ax: float, ay: float, bx: float, by: float) -> bool:
        """Whether no crop row stands between two points."""
        return not any(row.crosses(ax, ay, bx, by) for row in self.rows)

    def lane_at(self, x: float, y: float) -> str | None:
        """The label of the lane that holds a point."""
        return next(
            (lane.label for lane in self.lanes if lane.area.contains(x, y)), None
        )
