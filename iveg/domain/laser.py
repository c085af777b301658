"""Laser tracks of a robot: obstacles near it that nothing explains.

A camera sees less than half of the people beside a robot; its laser sees most of the
others.  Returns count within two metres of the robot's outline, if neither the plan of
the greenhouse nor a known peer explains them.  Together they must have a person's size,
or have moved, and last for 0.2 s.  Without a drawn plan only the robot's own path
counts, or every row would slow it.

Laser tracks only add: they lift no limit, and prove no place empty.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from iveg.domain.fleet import CAUTIOUS
from iveg.domain.geometry import Pose2D, Rectangle, Twist2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import LaserScan

LASTS_S = 0.2
"""Least duration of an obstacle; anything shorter is noise, or an insect (s)."""
_Place = tuple[float, float]
_LARGEST_M = 1.0
"""Size of two people side by side; a larger obstacle counts once it moves (m)."""
_MOVED_M = 0.4
"""Way from which a larger obstacle counts (m)."""
_WALKED_M, _WALKED_S, _PASSED_M = 0.5, 0.5, 0.3
"""Least way in ``map`` (m), time (s), and way in ``base_link`` (m) of a walking person.

A towed load stays in ``base_link``; a wall that the robot passes stays in ``map``.
"""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Something near a robot that nothing explains.

    Attributes:
        place: Its middle in ``map`` (m).
        first: Its middle in the first scan that shows it (m).
        beside: Its middle in the robot's ``base_link`` (m).
        first_beside: Its middle in that scan, in ``base_link`` (m).
        size_m: Diagonal of the box about its returns (m).
        gap_m: Distance from the robot's outline to its nearest return (m).
        since: Time of its first scan (monotonic, s).
        at: Time of its newest scan (monotonic, s).
        walked: Whether it has moved like a walking person.
    """

    place: _Place
    first: _Place
    beside: _Place
    first_beside: _Place
    size_m: float
    gap_m: float
    since: float
    at: float
    walked: bool = False

    def seen_again(self, newest: "Obstacle") -> "Obstacle":
        """The obstacle after a later scan, which shows it as ``newest``."""
        track = replace(
            newest, first=self.first, first_beside=self.first_beside, since=self.since
        )
        return replace(track, walked=self.walked or track.walks)

    @property
    def way_m(self) -> float:
        """Distance from its first place (m)."""
        return math.dist(self.place, self.first)

    @property
    def walks(self) -> bool:
        """Whether it moves like a walking person."""
        return (
            self.size_m <= _LARGEST_M
            and self.at - self.since >= _WALKED_S - 1e-6
            and self.way_m >= _WALKED_M
            and math.dist(self.beside, self.first_beside) >= _PASSED_M
        )

    @property
    def fits(self) -> bool:
        """Whether it has a person's size, or has moved."""
        return self.size_m <= _LARGEST_M or self.way_m > _MOVED_M

    @property
    def counts(self) -> bool:
        """Whether it fits, and has lasted for long enough."""
        return self.fits and self.at - self.since >= LASTS_S - 1e-6


_Floats = NDArray[np.float64]
GONE_S = 0.5
"""Time without a return after which an obstacle is gone (s)."""
PLAN_M = 0.4
"""Error of the plan or overhang of plants, 0.2 m, and error of the pose (m)."""
_TURN_S = 0.05
"""Time between a scan and the pose that places it (s)."""
_PEER_M = 1.0
"""Radius about a driving peer: half its body, and its way since its pose (m).

It may be generous, since a driving peer slows everybody near it anyway.
"""
_BESIDE_PEER_M = 0.3
"""Margin about the body of a standing peer: errors of both poses (m)."""
_APART_M = 0.3
"""Greatest distance between neighbouring returns of one body (m)."""
_LEAST_RETURNS = 2
_BESIDE_M = 0.2
"""Margin beside the robot's own path, where there is no plan (m)."""
_REPORTED_FOR_S = 0.1
"""Time for which each of several walking people is reported in turn (s)."""
_EVERY_S = 0.09
"""Least time between scans: ten a second are enough, and spare the processor (s)."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Plan of the greenhouse: walls, rows, posts and obstacles, in ``map`` (m).

    Attributes:
        bounds: The outer wall.
        rectangles: Shape (n, 4): xmin, ymin, xmax, ymax of rows, crates, trolleys.
        posts: Shape (n, 3): x, y, radius.
    """

    bounds: Rectangle
    rectangles: _Floats
    posts: _Floats

    @classmethod
    def from_greenhouse(cls, greenhouse: Greenhouse) -> "Plan":
        """The plan of a greenhouse."""
        areas = (*greenhouse.rows, *(crate.area for crate in greenhouse.obstacles))
        sides = [(area.xmin, area.ymin, area.xmax, area.ymax) for area in areas]
        posts = [(post.x, post.y, post.radius) for post in greenhouse.posts]
        return cls(
            greenhouse.bounds,
            np.array(sides, np.float64).reshape(-1, 4),
            np.array(posts, np.float64).reshape(-1, 3),
        )

    @property
    def is_drawn(self) -> bool:
        """Whether it shows more than the outer wall."""
        return len(self.rectangles) + len(self.posts) > 0

    def distance_to(self, x: _Floats, y: _Floats) -> _Floats:
        """Distances of points, shape (n,), from the nearest part of the plan (m)."""
        area = self.bounds
        inside = np.minimum.reduce(
            (x - area.xmin, area.xmax - x, y - area.ymin, area.ymax - y)
        )
        # Outside the wall the plan explains everything: distance 0.
        nearest: _Floats = np.maximum(inside, 0.0)
        if len(self.rectangles):
            nearest = np.minimum(nearest, _from_areas(self.rectangles, x, y).min(0))
        if len(self.posts):
            nearest = np.minimum(nearest, _from_posts(self.posts, x, y).min(0))
        return nearest


def _from_areas(areas: _Floats, x: _Floats, y: _Floats) -> _Floats:
    """Distances of points from rectangles (m); shape (rectangles, points)."""
    xmin, ymin, xmax, ymax = areas.T[..., None]
    aside = np.maximum(np.maximum(xmin - x, x - xmax), 0.0)
    along = np.maximum(np.maximum(ymin - y, y - ymax), 0.0)
    away: _Floats = np.hypot(aside, along)
    return away


def _from_posts(posts: _Floats, x: _Floats, y: _Floats) -> _Floats:
    """Distances of points from posts (m); shape (posts, points)."""
    post_x, post_y, radius = posts.T[..., None]
    away: _Floats = np.hypot(x - post_x, y - post_y) - radius
    return away


@dataclass(frozen=True, slots=True)
class Outline:
    """Outline of a robot from above, centred on ``base_link``: length, width (m)."""

    length: float = CAUTIOUS.length
    width: float = CAUTIOUS.width

    def gap_to(self, x: _Floats, y: _Floats) -> _Floats:
        """Distances of points in ``base_link``, shape (n,), from the outline (m)."""
        along = np.maximum(np.abs(x) - self.length / 2, 0.0)
        aside = np.maximum(np.abs(y) - self.width / 2, 0.0)
        distance: _Floats = np.hypot(along, aside)
        return distance


@dataclass(frozen=True, slots=True)
class KnownPeer:
    """A peer at its own pose in ``map``; its body counts as large as the robot's."""

    pose: Pose2D
    stands: bool


class LaserTracks:
    """Laser tracks of the obstacles beside one robot.

    Args:
        outline: Outline of the robot.
        plan: Plan of the greenhouse; None: there is none.
    """

    def __init__(self, outline: Outline, plan: Plan | None) -> None:
        self._outline = outline
        self._plan = plan
        self._known: tuple[Obstacle, ...] = ()
        self._looked_at = -math.inf

    def look(
        self,
        scan: LaserScan,
        pose: Pose2D,
        twist: Twist2D,
        known: Iterable[KnownPeer],
        now: float,
    ) -> None:
        """Take a scan.

        Args:
            scan: The scan.
            pose: The robot's pose in ``map`` at that time.
            twist: The robot's twist.
            known: Peers, whose returns are explained.
            now: This moment (monotonic, s).
        """
        if now - self._looked_at < _EVERY_S:
            return
        self._looked_at = now
        bodies = _bodies(self._unexplained(scan, pose, twist, known))
        if self._plan is None or not self._plan.is_drawn:
            bodies = [body for body in bodies if self._is_ahead(body, pose, twist)]
        earlier = [track for track in self._known if now - track.at <= GONE_S]
        newest = [
            self._joined(self._measured(body, pose, now), earlier) for body in bodies
        ]
        # ``_joined`` took out all that go on; the others may come back.
        self._known = (*newest, *earlier)

    def present(self, now: float) -> list[Obstacle]:
        """Obstacles that count and were seen within the last half second."""
        return [
            track for track in self._known if track.counts and now - track.at <= GONE_S
        ]

    def obstacle(self, now: float) -> Obstacle | None:
        """Each walking obstacle in turn; if nothing walks, the nearest obstacle."""
        present = self.present(now)
        walking = [track for track in present if track.walked]
        if walking:
            # In turn, since a report has room for one, and iVeg needs all of them.
            return walking[int(now / _REPORTED_FOR_S) % len(walking)]
        return min(present, key=lambda track: track.gap_m, default=None)

    def _unexplained(
        self,
        scan: LaserScan,
        pose: Pose2D,
        twist: Twist2D,
        known: Iterable[KnownPeer],
    ) -> _Floats:
        """Returns near the robot without explanation; shape (n, 2), in ``map``."""
        x, y = scan.points(Pose2D(0.0, 0.0, 0.0)).astype(np.float64).T
        distance = self._outline.gap_to(x, y)
        # Distance 0: a return inside the outline is of the robot itself.
        near = (distance > 0.0) & (distance <= LIMITS.zone_default_m)
        away = np.hypot(x, y)[near]
        x, y = pose.transform(x[near], y[near])
        is_obstacle = np.ones(x.shape, np.bool_)
        if self._plan is not None:
            # While the robot turns, far returns are placed worse than near ones.
            blurred = PLAN_M + abs(twist.angular_z) * _TURN_S * away
            is_obstacle = self._plan.distance_to(x, y) > blurred
        for peer in known:
            along, aside = peer.pose.inverse(x, y)
            if peer.stands:
                is_obstacle &= self._outline.gap_to(along, aside) > _BESIDE_PEER_M
            else:
                is_obstacle &= np.hypot(along, aside) > _PEER_M
        return np.column_stack((x[is_obstacle], y[is_obstacle]))

    def _is_ahead(self, body: _Floats, pose: Pose2D, twist: Twist2D) -> bool:
        """Whether a part of a body lies where the robot is driving."""
        x, y = pose.inverse(*body.T)
        in_front = (x > 0.0) == (twist.linear_x >= 0.0)
        return bool(
            np.any(in_front & (np.abs(y) <= self._outline.width / 2 + _BESIDE_M))
        )

    def _joined(self, newest: Obstacle, earlier: list[Obstacle]) -> Obstacle:
        """The nearest earlier obstacle that it may continue, else itself.

        The earlier obstacle is removed from ``earlier``.
        """

        def away(track: Obstacle) -> float:
            return math.dist(track.place, newest.place)

        near = min(earlier, key=away, default=None)
        if near is None:
            return newest
        if away(near) > _APART_M + LIMITS.walking_m_s * (newest.at - near.at):
            return newest
        earlier.remove(near)
        return near.seen_again(newest)

    def _measured(self, body: _Floats, pose: Pose2D, now: float) -> Obstacle:
        """A new obstacle from neighbouring returns."""
        x, y = body.mean(0).tolist()
        along, aside = pose.inverse(*body.T)
        size_m = float(np.hypot(*np.ptp(body, axis=0)))
        gap_m = float(self._outline.gap_to(along, aside).min())
        beside = float(along.mean()), float(aside.mean())
        here = x, y
        return Obstacle(here, here, beside, beside, size_m, gap_m, now, now)


def _bodies(points: _Floats) -> Sequence[_Floats]:
    """Bodies: groups of neighbouring returns, in the order of the beams."""
    if not len(points):
        return ()
    distances = np.hypot(*np.diff(points, axis=0).T)
    parts = np.split(points, np.flatnonzero(distances > _APART_M) + 1)
    # A sweep may begin in the middle of a body.
    if len(parts) > 1 and math.dist(points[-1], points[0]) <= _APART_M:
        parts = [np.concatenate((parts[-1], parts[0])), *parts[1:-1]]
    return [part for part in parts if len(part) >= _LEAST_RETURNS]
