"""The laser as a second witness: what stands near a robot and nobody has explained.

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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.fleet import CAUTIOUS
from iveg.domain.geometry import Pose2D, Rectangle, Twist2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.known import KnownPlace, is_known
from iveg.domain.limits import LIMITS
from iveg.domain.observations import LaserScan
from iveg.domain.obstacle import Body, Obstacle

_Floats = NDArray[np.float64]
GONE_S = 0.5
"""Without a return for so long it is gone."""
PLAN_M = 0.4
"""The plan is off by 0.2 m, or plants lean out so far; a pose is off by the rest."""
_TURN_S = 0.05
"""A scan and the pose that it is placed by are so far apart."""
_PEER_M = 1.0
"""About a peer's ``base_link``: half of its body, and how far it went since it told."""
_APART_M = 0.3
"""Returns of one body are not farther apart."""
_FOLLOWED_M = 0.6
"""About the middle of who is followed: where a scan may have them by noise."""
_ONE_M = 0.7
"""Two people beside each other are larger."""
_ROUNDING_M = 0.01
_LEAST_RETURNS = 2
_BESIDE_M = 0.2
"""Of the robot's own path, where there is no plan."""
_EVERY_S = 0.09
"""Ten sweeps a second are enough, and leave the robot's processor alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What stands in the greenhouse, in ``map`` (m).

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
        """How far points, shape (n,), are from the nearest thing drawn (m)."""
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

    def about(self, pose: Pose2D, reach_m: float) -> "Plan":
        """The part of it that is within reach of a place."""
        x, y = np.array([pose.x]), np.array([pose.y])
        return Plan(
            self.bounds,
            self.rectangles[_from_areas(self.rectangles, x, y)[:, 0] <= reach_m],
            self.posts[_from_posts(self.posts, x, y)[:, 0] <= reach_m],
        )


def _from_areas(areas: _Floats, x: _Floats, y: _Floats) -> _Floats:
    """How far points are from rectangles (m); shape (rectangles, points)."""
    xmin, ymin, xmax, ymax = areas.T[..., None]
    aside = np.maximum(np.maximum(xmin - x, x - xmax), 0.0)
    along = np.maximum(np.maximum(ymin - y, y - ymax), 0.0)
    away: _Floats = np.hypot(aside, along)
    return away


def _from_posts(posts: _Floats, x: _Floats, y: _Floats) -> _Floats:
    """How far points are from posts (m); shape (posts, points)."""
    post_x, post_y, radius = posts.T[..., None]
    away: _Floats = np.hypot(x - post_x, y - post_y) - radius
    return away


@dataclass(frozen=True, slots=True)
class Outline:
    """A robot seen from above, centred on ``base_link``: length and width (m)."""

    length: float = CAUTIOUS.length
    width: float = CAUTIOUS.width

    def gap_to(self, x: _Floats, y: _Floats) -> _Floats:
        """How far points in ``base_link``, shape (n,), are from it (m)."""
        ahead = np.maximum(np.abs(x) - self.length / 2, 0.0)
        aside = np.maximum(np.abs(y) - self.width / 2, 0.0)
        gap: _Floats = np.hypot(ahead, aside)
        return gap


@dataclass(frozen=True, slots=True)
class KnownBody:
    """Somebody who is known, in ``map``: what a return there is explained by (m)."""

    x: float
    y: float
    radius: float

    @classmethod
    def of_peer(cls, pose: Pose2D) -> "KnownBody":
        """A peer, where it told that it is."""
        return cls(pose.x, pose.y, _PEER_M)


class Witness:
    """What one robot's laser sees beside it.

    Args:
        outline: The robot's body.
        plan: None: nobody drew the place.
        ahead_s: It looks farther by how far the robot drives in this time (s).
        follow_m: So far from itself it goes on seeing who walked beside it (m).
    """

    def __init__(
        self,
        outline: Outline,
        plan: Plan | None,
        ahead_s: float = 0.0,
        follow_m: float = 0.0,
    ) -> None:
        self._outline = outline
        self._plan = plan
        self._ahead_s = ahead_s
        self._follow_m = follow_m
        self._known: tuple[Obstacle, ...] = ()
        self.walkers: tuple[Obstacle, ...] = ()
        """Of the last scan, those who walk, or walked just now."""
        self.newest: tuple[Obstacle, ...] = ()
        """Everything of the last scan that neither the plan nor somebody explains."""
        self._places: tuple[KnownPlace, ...] = ()
        self._looked_at = -math.inf
        self._reach_m = LIMITS.ring_default_m

    def look(
        self,
        scan: LaserScan,
        pose: Pose2D,
        twist: Twist2D,
        known: Iterable[KnownBody],
        now: float,
        places: Iterable[KnownPlace] = (),
    ) -> None:
        """Take a scan, made at ``pose`` in ``map`` (monotonic, s).

        What never left one of the ``places`` and does not move slows nobody.
        """
        if now - self._looked_at < _EVERY_S:
            return
        self._looked_at = now
        self._places = tuple(places)
        self._reach_m = LIMITS.ring_default_m + self._ahead_s * abs(twist.linear_x)
        followed = [one for one in self._known if self._is_followed(one, now)]
        bodies = _bodies(self._unexplained(scan, pose, twist, known, followed, now))
        if followed:
            bodies = self._told_apart(bodies, pose, followed, now)
        if self._plan is None or not self._plan.is_drawn:
            bodies = [one for one in bodies if self._is_ahead(one, pose, twist)]
        earlier = [one for one in self._known if now - one.at <= GONE_S]
        seen = [self._joined(body, earlier, pose, now) for body in bodies]
        self._known = (*seen, *earlier)
        self.newest = tuple(seen)
        self.walkers = tuple(one for one in seen if one.is_somebody)

    @property
    def is_unsure(self) -> bool:
        """Whether the next look may make something count."""
        return any(one.fits and not one.counts for one in self._known)

    def present(self, now: float) -> list[Obstacle]:
        """What counts and was there within the last half second."""
        counts = (one for one in self._known if one.counts and now - one.at <= GONE_S)
        return [one for one in counts if not is_known(one, self._places)]

    def obstacle(self, now: float) -> Obstacle | None:
        """The oldest of them."""
        return min(self.present(now), key=lambda one: one.since, default=None)

    def _unexplained(
        self,
        scan: LaserScan,
        pose: Pose2D,
        twist: Twist2D,
        known: Iterable[KnownBody],
        followed: Iterable[Obstacle],
        now: float,
    ) -> _Floats:
        """Returns near the robot that nothing explains; shape (n, 2), in ``map``."""
        x, y = scan.points(Pose2D(0.0, 0.0, 0.0)).astype(np.float64).T
        gap = self._outline.gap_to(x, y)
        near = (gap > 0.0) & (gap <= self._reach_m)
        for who in followed:
            ahead, aside = pose.inverse(who.x, who.y)
            theirs = np.hypot(x - ahead, y - aside) <= _about(who, now)
            near |= theirs & (gap > 0.0) & (gap <= self._follow_m)
        away = np.hypot(x, y)[near]
        farthest = float(away.max(initial=0.0))
        x, y = _moved(x[near], y[near], pose)
        left = np.ones(x.shape, np.bool_)
        if self._plan is not None:
            blurred = PLAN_M + abs(twist.angular_z) * _TURN_S * away
            plan = self._plan.about(pose, farthest + 2 * PLAN_M)
            left = plan.distance_to(x, y) > blurred
        for one in known:
            if pose.distance_to(one.x, one.y) <= farthest + one.radius + _ROUNDING_M:
                left &= np.hypot(x - one.x, y - one.y) > one.radius
        return np.column_stack((x[left], y[left]))

    def _is_followed(self, one: Obstacle, now: float) -> bool:
        """Whether it goes on seeing who walked beside the robot."""
        is_new = self._follow_m > 0.0 and now - one.at <= GONE_S
        return is_new and one.is_somebody

    def _told_apart(
        self,
        bodies: Sequence[_Floats],
        pose: Pose2D,
        followed: Sequence[Obstacle],
        now: float,
    ) -> Sequence[_Floats]:
        """Bodies; beyond reach only where it is plain who each is.

        Where two may be who is followed, neither is, and whoever was is remembered.
        """
        kept = [one for one in bodies if self._gap_to(one, pose) <= self._reach_m]
        for who in followed:
            may_be = [
                one
                for one in bodies
                if math.dist(one.mean(0), (who.x, who.y)) <= _about(who, now)
            ]
            if len(may_be) == 1 and np.hypot(*np.ptp(may_be[0], axis=0)) <= _ONE_M:
                kept += [one for one in may_be if not any(one is x for x in kept)]
        return kept

    def _gap_to(self, body: _Floats, pose: Pose2D) -> float:
        return float(self._outline.gap_to(*_seen_from(pose, body)).min())

    def _is_ahead(self, body: _Floats, pose: Pose2D, twist: Twist2D) -> bool:
        """Whether a part of a body lies where the robot is driving."""
        x, y = _seen_from(pose, body)
        ahead = (x > 0.0) == (twist.linear_x >= 0.0)
        return bool(np.any(ahead & (np.abs(y) <= self._outline.width / 2 + _BESIDE_M)))

    def _joined(
        self, body: _Floats, earlier: list[Obstacle], pose: Pose2D, now: float
    ) -> Obstacle:
        """A body as the nearest earlier obstacle that it may be, or a new one.

        That one is taken out of ``earlier``.
        """
        found = self._measured(body, pose)
        x, y = found.x, found.y
        near = min(
            earlier, key=lambda one: math.hypot(one.x - x, one.y - y), default=None
        )
        if near is not None:
            reach = _APART_M + LIMITS.walking_m_s * (now - near.at)
            if math.hypot(near.x - x, near.y - y) <= reach:
                earlier.remove(near)
                return near.seen_again(found, now)
        return Obstacle.new(found, now)

    def _measured(self, body: _Floats, pose: Pose2D) -> Body:
        x, y = (float(one) for one in body.mean(0))
        (xmin, ymin), (xmax, ymax) = body.min(0).tolist(), body.max(0).tolist()
        ahead, aside = _seen_from(pose, body)
        plan, out_m = self._plan, math.inf
        if plan is not None and plan.is_drawn:
            out_m = float(plan.distance_to(body[:, 0], body[:, 1]).max())
        return Body(
            x,
            y,
            float(np.hypot(*np.ptp(body, axis=0))),
            float(self._outline.gap_to(ahead, aside).min()),
            (float(ahead.mean()), float(aside.mean())),
            Rectangle(xmin, ymin, xmax, ymax),
            out_m,
        )


def _about(one: Obstacle, now: float) -> float:
    """How far who is followed may be from where they were seen last (m)."""
    return _FOLLOWED_M + LIMITS.walking_m_s * (now - one.at)


def _moved(x: _Floats, y: _Floats, frame: Pose2D) -> tuple[_Floats, _Floats]:
    """Points of a frame with this pose, in ``map``."""
    c, s = math.cos(frame.yaw), math.sin(frame.yaw)
    return frame.x + c * x - s * y, frame.y + s * x + c * y


def _seen_from(pose: Pose2D, points: _Floats) -> tuple[_Floats, _Floats]:
    """Points of ``map``, shape (n, 2), in the frame with this pose: x and y."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    x, y = points[:, 0] - pose.x, points[:, 1] - pose.y
    return c * x + s * y, c * y - s * x


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
