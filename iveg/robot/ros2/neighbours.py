"""People and robots nearby, as reported by peers: for Nav2's costmap and for RViz.

The paper's costmap injection.  A point cloud in ``base_link`` holds a disc for each
person and peer, and a circle of far points that clear the layer: a separate layer
(docs/robots.md) marks the discs and removes old ones.  Markers are in ``map``.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.feedback import Feedback
from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.ros2 import messages as m

SILENT_S = LIMITS.feedback_stand_s
"""Age from which feedback gives no positions (s)."""
PERSON_M, PEER_M = 0.35, 0.75
REACH_M = 8.0
"""Greatest distance of a disc (m); the clearing circle is a metre beyond."""
_MYSELF_M = 1.0
_SPACING_M = 0.1
_HEIGHT_M = 0.5
_RAYS = 1440
_MARKER_LIVES_S = 1
_MOST = 256
_CYLINDER, _TEXT = 3, 9


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A person or robot in ``map`` (m).

    Attributes:
        kind: ``person`` or ``robot``.
        radius: Radius of the body (m).
        ring: Radius of the rule (m).
    """

    kind: str
    name: str
    x: float
    y: float
    radius: float
    ring: float


@dataclass(frozen=True, slots=True)
class _Told:
    """Newest feedback of a topic.

    Attributes:
        at: When it came (monotonic, s).
        posed: When its pose was news: a peer that is gone keeps the stamp of its last.
    """

    feedback: Feedback
    at: float
    posed: float


class Neighbours:
    """Newest feedback of each topic; times are monotonic seconds.

    Args:
        robot_id: This robot, which is left out.
    """

    def __init__(self, robot_id: str) -> None:
        self._me = robot_id
        self._told: dict[str, _Told] = {}

    def note(self, peer: str, feedback: Feedback, now: float) -> None:
        """Store the content of ``/{peer}/mqtt_feedback``."""
        before, stamp = self._told.get(peer), feedback.pose_stamp
        is_old = before is not None and stamp and before.feedback.pose_stamp == stamp
        posed = before.posed if before is not None and is_old else now
        self._told[peer] = _Told(feedback, now, posed)
        while len(self._told) > _MOST:
            del self._told[next(iter(self._told))]

    def present(self, own: Pose2D | None, now: float) -> list[Neighbour]:
        """All but this robot; one reported on two topics is listed once.

        A peer whose pose stays the same message for ``ring_lasts_s`` is left out:
        nobody knows any more where it is, or that it is there at all.
        """
        live = [one for one in self._told.values() if now - one.at <= SILENT_S]
        found: dict[object, Neighbour] = {}
        for told in live:
            feedback = told.feedback
            for one in self._people(feedback, own):
                found[one.kind, round(one.x, 1), round(one.y, 1)] = one
            peer = feedback.pose if now - told.posed <= LIMITS.ring_lasts_s else None
            if feedback.robot_id != self._me and peer is not None:
                name = feedback.robot_id
                found[name] = Neighbour("robot", name, peer.x, peer.y, PEER_M, 2.0)
        return list(found.values())[:_MOST]

    def _people(self, feedback: Feedback, own: Pose2D | None) -> Iterator[Neighbour]:
        for alert in feedback.alerts:
            if alert.position is None or alert.class_ is None:
                continue
            x, y, _ = alert.position
            near = own is not None and own.distance_to(x, y) <= _MYSELF_M
            if alert.class_ == "robot" and (alert.class_id == self._me or near):
                continue
            radius = PERSON_M if alert.class_ == "person" else PEER_M
            name = alert.class_id or alert.class_
            ring = alert.radius_m or LIMITS.ring_default_m
            yield Neighbour(alert.class_, name, x, y, radius, ring)


def cloud(
    neighbours: Iterable[Neighbour], own: Pose2D, stamp: m.Time, frame: str
) -> m.PointCloud2:
    """Discs to mark and a circle to clear, in ``base_link``."""
    discs = [
        _disc(one, own)
        for one in neighbours
        if own.distance_to(one.x, one.y) <= REACH_M
    ]
    points = np.ascontiguousarray(np.concatenate([_CIRCLE, *discs]), "<f4")
    return m.PointCloud2(
        m.Header(stamp, frame),
        1,
        len(points),
        tuple(m.PointField(name, 4 * n) for n, name in enumerate("xyz")),
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
    neighbours: Iterable[Neighbour], stamp: m.Time, frame: str
) -> m.MarkerArray:
    """Body, radius and name of each, with a lifetime of a second."""
    found: list[m.Marker] = []
    for number, one in enumerate(neighbours):
        place = m.Point(one.x, one.y, 0.9)
        red = m.ColorRGBA(0.9, 0.2, 0.1, 0.9)
        body = red if one.kind == "person" else m.ColorRGBA(0.1, 0.4, 0.9, 0.9)
        ring = m.ColorRGBA(body.r, body.g, body.b, 0.15)
        header = m.Header(stamp, frame)
        found += [
            _marker(header, f"{one.kind} body", number, place, 2 * one.radius, body),
            _marker(header, f"{one.kind} ring", number, place, 2 * one.ring, ring),
            m.Marker(
                header,
                f"{one.kind} name",
                number,
                _TEXT,
                pose=m.Pose(m.Point(one.x, one.y, 2.1)),
                scale=m.Vector3(0.0, 0.0, 0.4),
                color=m.ColorRGBA(1.0, 1.0, 1.0, 1.0),
                lifetime=m.Duration(_MARKER_LIVES_S),
                text=one.name,
            ),
        ]
    return m.MarkerArray(tuple(found))


def _marker(
    header: m.Header,
    ns: str,
    number: int,
    place: m.Point,
    width: float,
    color: m.ColorRGBA,
) -> m.Marker:
    flat = width > 2 * PEER_M
    return m.Marker(
        header,
        ns,
        number,
        _CYLINDER,
        pose=m.Pose(m.Point(place.x, place.y, 0.01) if flat else place),
        scale=m.Vector3(width, width, 0.02 if flat else 1.8),
        color=color,
        lifetime=m.Duration(_MARKER_LIVES_S),
    )
