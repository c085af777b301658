"""People and robots nearby for Nav2's costmap and for RViz.

The paper's costmap injection.  A point cloud in ``base_link`` holds a disc for each
person and peer, and a circle of far points that clear the layer: a separate layer
(docs/robots.md) marks the discs and removes old ones.  Markers are in ``map``.
"""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.robot.neighbours import PEER_M, Neighbour
from iveg.ros2 import geometry_msgs, sensor_msgs, std_msgs, visualization_msgs

REACH_M = 8.0
"""Greatest distance of a disc (m); the clearing circle is a metre beyond."""
_SPACING_M = 0.1
_HEIGHT_M = 0.5
_RAYS = 1440
_MARKER_LIVES_S = 1
_CYLINDER, _TEXT = 3, 9


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


def markers(
    neighbours: Iterable[Neighbour], stamp: std_msgs.Time, frame: str
) -> visualization_msgs.MarkerArray:
    """Body, radius and name of each, with a lifetime of a second."""
    found: list[visualization_msgs.Marker] = []
    for number, one in enumerate(neighbours):
        place = geometry_msgs.Point(one.x, one.y, 0.9)
        red = std_msgs.ColorRGBA(0.9, 0.2, 0.1, 0.9)
        body = red if one.kind == "person" else std_msgs.ColorRGBA(0.1, 0.4, 0.9, 0.9)
        ring = std_msgs.ColorRGBA(body.r, body.g, body.b, 0.15)
        header = std_msgs.Header(stamp, frame)
        found += [
            _marker(header, f"{one.kind} body", number, place, 2 * one.radius, body),
            _marker(header, f"{one.kind} ring", number, place, 2 * one.ring, ring),
            visualization_msgs.Marker(
                header,
                f"{one.kind} name",
                number,
                _TEXT,
                pose=geometry_msgs.Pose(geometry_msgs.Point(one.x, one.y, 2.1)),
                scale=geometry_msgs.Vector3(0.0, 0.0, 0.4),
                color=std_msgs.ColorRGBA(1.0, 1.0, 1.0, 1.0),
                lifetime=std_msgs.Duration(_MARKER_LIVES_S),
                text=one.name,
            ),
        ]
    return visualization_msgs.MarkerArray(tuple(found))


def _marker(
    header: std_msgs.Header,
    ns: str,
    number: int,
    place: geometry_msgs.Point,
    width: float,
    color: std_msgs.ColorRGBA,
) -> visualization_msgs.Marker:
    flat = width > 2 * PEER_M
    return visualization_msgs.Marker(
        header,
        ns,
        number,
        _CYLINDER,
        pose=geometry_msgs.Pose(
            geometry_msgs.Point(place.x, place.y, 0.01) if flat else place
        ),
        scale=geometry_msgs.Vector3(width, width, 0.02 if flat else 1.8),
        color=color,
        lifetime=std_msgs.Duration(_MARKER_LIVES_S),
    )
