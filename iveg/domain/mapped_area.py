"""The area to map where a greenhouse has no walls: around its robots."""

import math
from collections.abc import Iterable

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.occupancy_grid import Grid

_WINDOW_M, _WINDOW_MARGIN_M, _WINDOW_EDGE_M = 60.0, 20.0, 8.0


def window_round(poses: Iterable[Pose2D], before: Grid | None) -> Grid | None:
    """The area to map when there are no walls: around the robots, at most 60 m wide.

    The window stays in place while every robot is well inside; None without robots.
    """
    places = [(pose.x, pose.y) for pose in poses]
    if not places:
        return before
    x, y = zip(*places, strict=True)
    box = Rectangle(min(x), min(y), max(x), max(y))
    if before is not None and _holds(before, box):
        return before
    sides = (box.xmin, box.xmax), (box.ymin, box.ymax)
    (west, east), (south, north) = (_stretch(*side) for side in sides)
    return Grid.over(Rectangle(west, south, east, north))


def _holds(grid: Grid, box: Rectangle) -> bool:
    xmax = grid.xmin + grid.width * grid.resolution
    ymax = grid.ymin + grid.height * grid.resolution
    return (
        grid.xmin + _WINDOW_EDGE_M <= box.xmin
        and grid.ymin + _WINDOW_EDGE_M <= box.ymin
        and box.xmax <= xmax - _WINDOW_EDGE_M
        and box.ymax <= ymax - _WINDOW_EDGE_M
    )


def _stretch(low: float, high: float) -> tuple[float, float]:
    """One side of the window (m), on whole metres so that cells meet cells."""
    half = min(_WINDOW_M, high - low + 2 * _WINDOW_MARGIN_M) / 2
    middle, half = round((low + high) / 2), math.ceil(half)
    return middle - half, middle + half
