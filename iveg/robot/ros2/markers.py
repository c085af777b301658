"""Neighbours as shapes in RViz, in ``map``."""

from collections.abc import Iterable

from iveg.robot.neighbours import PEER_M, Neighbour
from iveg.ros2 import geometry_msgs, std_msgs, visualization_msgs

_MARKER_LIVES_S = 1


_CYLINDER, _TEXT = 3, 9


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
