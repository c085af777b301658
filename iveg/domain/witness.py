"""The laser as a second witness: obstacles near a robot that nobody has explained.

A camera sees less than half of the people beside a robot; its laser sees most of the
others.  Of a scan those returns count that are within two metres of the robot's outline
and that neither the plan of the greenhouse nor somebody who is known explains.
Together they must be of a person's size, or have moved, and last for 0.2 s.  Where no
plan draws what stands there only the robot's own path counts, or every row would slow
it.

A witness only adds: it lifts no limit, and finds no spot empty.
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
"""Anything shorter is noise, or an insect."""
_Place = tuple[float, float]
_LARGEST_M = 1.0
"""Two people side by side; what is larger is counted once it moves."""
_MOVED_M = 0.4
_WALKED_M, _WALKED_S, _PASSED_M = 0.5, 0.5, 0.3
"""Least way, time, and way as seen from the robot, of somebody who walks: more than of
what it tows, or of the part of a wall that it sees as it passes."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Something of a person's size near a robot that nobody explained.

    Attributes:
        place: Its middle in ``map`` (m); ``first`` where it was when it was seen first.
        beside: The same in the robot's ``base_link`` (m); ``first_beside`` likewise.
        size_m: From its first return to its last.
        gap_m: From the robot's outline to its nearest return.
        since: When it was seen first; ``at`` newest (monotonic, s).
        walked: Whether it moved like somebody who walks.
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

    def seen_again(self, found: "Obstacle") -> "Obstacle":
        """The obstacle with what a later scan found of it."""
        seen = replace(
            found, first=self.first, first_beside=self.first_beside, since=self.since
        )
        return replace(seen, walked=self.walked or seen.walks)

    @property
    def way_m(self) -> float:
        """Distance from where it was seen first (m)."""
        return math.dist(self.place, self.first)

    @property
    def walks(self) -> bool:
        """Whether it went like somebody who walks."""
        return (
            self.size_m <= _LARGEST_M
            and self.at - self.since >= _WALKED_S - 1e-6
            and self.way_m >= _WALKED_M
            and math.dist(self.beside, self.first_beside) >= _PASSED_M
        )

    @property
    def fits(self) -> bool:
        """Whether it is or moves like somebody."""
        return self.size_m <= _LARGEST_M or self.way_m > _MOVED_M

    @property
    def counts(self) -> bool:
        """Whether it is there for long enough, too."""
        return self.fits and self.at - self.since >= LASTS_S - 1e-6


_Floats = NDArray[np.float64]
GONE_S = 0.5
"""Without a return for so long it is gone."""
PLAN_M = 0.4
"""The plan is off by 0.2 m, or plants lean out so far; a pose is off by the rest."""
_TURN_S = 0.05
"""A scan and the pose that it is placed by are so far apart."""
_PEER_M = 1.0
"""About the ``base_link`` of a peer that drives, who slows everybody near it anyway:
half of its body, and how far it went since it told."""
_BESIDE_PEER_M = 0.3
"""About the body of one that stands: errors of both poses."""
_APART_M = 0.3
"""Returns of one body are not farther apart."""
_LEAST_RETURNS = 2
_BESIDE_M = 0.2
"""Margin beside the robot's own path, where there is no plan."""
_TURN_OF_ONE_S = 0.1
_EVERY_S = 0.09
"""Ten sweeps a second are enough, and leave the robot's processor alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Outlines of the greenhouse and its rows, posts and obstacles, in ``map`` (m).

    Attributes:
        bounds: The outer wall.
        rectangles: Shape (n, 4): xmin, ymin, xmax, ymax of rows, crates, trolleys.
        posts: Shape (n, 3): x, y, radius.
    """

    bounds: Rectangle
    rectangles: _Floats
    posts: _Floats

    @classmethod
    def of(cls, greenhouse: Greenhouse) -> "Plan":
        """The plan of a greenhouse."""
        areas = (*greenhouse.rows, *(one.area for one in greenhouse.obstacles))
        sides = [(one.xmin, one.ymin, one.xmax, one.ymax) for one in areas]
        posts = [(one.x, one.y, one.radius) for one in greenhouse.posts]
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
        """Distances of points, shape (n,), from the nearest thing drawn (m)."""
        area = self.bounds
        inside = np.minimum.reduce(
            (x - area.xmin, area.xmax - x, y - area.ymin, area.ymax - y)
        )
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
    """A robot seen from above, centred on ``base_link``: length and width (m)."""

    length: float = CAUTIOUS.length
    width: float = CAUTIOUS.width

    def gap_to(self, x: _Floats, y: _Floats) -> _Floats:
        """Distances of points in ``base_link``, shape (n,), from it (m)."""
        ahead = np.maximum(np.abs(x) - self.length / 2, 0.0)
        aside = np.maximum(np.abs(y) - self.width / 2, 0.0)
        gap: _Floats = np.hypot(ahead, aside)
        return gap


@dataclass(frozen=True, slots=True)
class KnownPeer:
    """A peer where it told that it is, in ``map``; its body is taken for the same."""

    pose: Pose2D
    stands: bool


class Witness:
    """Laser tracks of the obstacles beside one robot.

    Args:
        outline: The robot's body.
        plan: None: nobody drew the place.
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
        """Take a scan, made at ``pose`` in ``map`` (monotonic, s)."""
        if now - self._looked_at < _EVERY_S:
            return
        self._looked_at = now
        bodies = _bodies(self._unexplained(scan, pose, twist, known))
        if self._plan is None or not self._plan.is_drawn:
            bodies = [one for one in bodies if self._is_ahead(one, pose, twist)]
        earlier = [one for one in self._known if now - one.at <= GONE_S]
        found = [self._measured(body, pose, now) for body in bodies]
        seen = [self._joined(one, earlier) for one in found]
        self._known = (*seen, *earlier)

    def present(self, now: float) -> list[Obstacle]:
        """Obstacles that count and were there within the last half second."""
        return [one for one in self._known if one.counts and now - one.at <= GONE_S]

    def obstacle(self, now: float) -> Obstacle | None:
        """Those who walk, in turn, so that nobody is left out; else the nearest."""
        present = self.present(now)
        walking = [one for one in present if one.walked]
        if walking:
            return walking[int(now / _TURN_OF_ONE_S) % len(walking)]
        return min(present, key=lambda one: one.gap_m, default=None)

    def _unexplained(
        self,
        scan: LaserScan,
        pose: Pose2D,
        twist: Twist2D,
        known: Iterable[KnownPeer],
    ) -> _Floats:
        """Returns near the robot that nothing explains; shape (n, 2), in ``map``."""
        x, y = scan.points(Pose2D(0.0, 0.0, 0.0)).astype(np.float64).T
        gap = self._outline.gap_to(x, y)
        near = (gap > 0.0) & (gap <= LIMITS.zone_default_m)
        away = np.hypot(x, y)[near]
        x, y = pose.transform(x[near], y[near])
        left = np.ones(x.shape, np.bool_)
        if self._plan is not None:
            blurred = PLAN_M + abs(twist.angular_z) * _TURN_S * away
            left = self._plan.distance_to(x, y) > blurred
        for one in known:
            ahead, aside = one.pose.inverse(x, y)
            if one.stands:
                left &= self._outline.gap_to(ahead, aside) > _BESIDE_PEER_M
            else:
                left &= np.hypot(ahead, aside) > _PEER_M
        return np.column_stack((x[left], y[left]))

    def _is_ahead(self, body: _Floats, pose: Pose2D, twist: Twist2D) -> bool:
        """Whether a part of a body lies where the robot is driving."""
        x, y = pose.inverse(*body.T)
        ahead = (x > 0.0) == (twist.linear_x >= 0.0)
        return bool(np.any(ahead & (np.abs(y) <= self._outline.width / 2 + _BESIDE_M)))

    def _joined(self, found: Obstacle, earlier: list[Obstacle]) -> Obstacle:
        """The nearest earlier obstacle that it may be, seen again; else it is new.

        That one is taken out of ``earlier``.
        """

        def away(one: Obstacle) -> float:
            return math.dist(one.place, found.place)

        near = min(earlier, key=away, default=None)
        if near is None:
            return found
        if away(near) > _APART_M + LIMITS.walking_m_s * (found.at - near.at):
            return found
        earlier.remove(near)
        return near.seen_again(found)

    def _measured(self, body: _Floats, pose: Pose2D, now: float) -> Obstacle:
        """Neighbouring returns as an obstacle that is seen for the first time."""
        x, y = body.mean(0).tolist()
        ahead, aside = pose.inverse(*body.T)
        size_m = float(np.hypot(*np.ptp(body, axis=0)))
        gap_m = float(self._outline.gap_to(ahead, aside).min())
        beside = float(ahead.mean()), float(aside.mean())
        here = x, y
        return Obstacle(here, here, beside, beside, size_m, gap_m, now, now)


def _bodies(points: _Floats) -> Sequence[_Floats]:
    """Neighbouring returns, in the order of the beams, as one body each."""
    if not len(points):
        return ()
    steps = np.hypot(*np.diff(points, axis=0).T)
    parts = np.split(points, np.flatnonzero(steps > _APART_M) + 1)
    # A sweep may begin in the middle of a body.
    if len(parts) > 1 and math.dist(points[-1], points[0]) <= _APART_M:
        parts = [np.concatenate((parts[-1], parts[0])), *parts[1:-1]]
    return [one for one in parts if len(one) >= _LEAST_RETURNS]
