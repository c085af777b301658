"""People and robots nearby for Nav2's costmap.

The paper's costmap injection.  A point cloud in ``base_link`` holds a disc for each
person and peer, and a circle of far points that clear the layer: a separate layer
(docs/robots.md) marks the discs and removes old ones.
"""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.robot.neighbours import Neighbour
from iveg.ros2 import sensor_msgs, std_msgs

REACH_M = 8.0
"""Greatest distance of a disc (m); the clearing circle is a metre beyond."""
_SPACING_M = 0.1
_HEIGHT_M = 0.5
_RAYS = 1440


def cloud(
    neighbours: Iterable[Neighbour], own: Pose2D, stamp: std_msgs.Time, frame: str
) -> sensor_msgs.PointCloud2:
    """Discs to mark and a circle to clear, in ``base_link``."""
    discs = [
        _disc(one, own)
        for one in neighbours
        if own.distance_to(one.x, one.y) <= REACH_M
    ]
    points = np.ascontiguousarray(np.concatenate([_CIRCLE, *discs]), "<f4")
    return sensor_msgs.PointCloud2(
        std_msgs.Header(stamp, frame),
        1,
        len(points),
        tuple(sensor_msgs.PointField(name, 4 * n) for n, name in enumerate("xyz")),
        False,
        12,
        12 * len(points),
        points.view(np.uint8).reshape(-1),
    )


def _circle() -> NDArray[np.float64]:
    angles = np.arange(_RAYS) * (math.tau / _RAYS)
    far = REACH_M + 1.0
    height = np.full(_RAYS, _HEIGHT_M)
    return np.stack((far * np.cos(angles), far * np.sin(angles), height), axis=1)


_CIRCLE = _circle()


def _disc(one: Neighbour, own: Pose2D) -> NDArray[np.float64]:
    c, s = math.cos(own.yaw), math.sin(own.yaw)
    dx, dy = one.x - own.x, one.y - own.y
    steps = np.arange(-one.radius, one.radius + _SPACING_M / 2, _SPACING_M)
    x, y = (side.reshape(-1) for side in np.meshgrid(steps, steps))
    inside = np.hypot(x, y) <= one.radius
    x, y = x[inside], y[inside]
    return np.stack(
        (
            x + c * dx + s * dy,
            y - s * dx + c * dy,
            np.full(x.size, _HEIGHT_M),
        ),
        axis=1,
    )
