"""Frames of one robot: rigid transforms, and the TF tree that holds them."""

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import IvegError
from iveg.domain.geometry import Pose2D
from iveg.ros2 import messages as ros

# --- rigid ------------------------------------------------------------------------
#
# Rigid transforms between frames, in plain numbers.
#
# NumPy is slower for so few numbers; a matrix is made to transform many points.

Three = tuple[float, float, float]
Four = tuple[float, float, float, float]
Rows = tuple[Three, Three, Three]


@dataclass(frozen=True, slots=True)
class RigidTransform:
    """Pose of a frame in another: p_outer = turn · p_inner + move (m).

    Attributes:
        move: Position of the inner frame's origin (m).
        q: Unit quaternion of the rotation: x, y, z, w.
    """

    move: Three = (0.0, 0.0, 0.0)
    q: Four = (0.0, 0.0, 0.0, 1.0)

    @property
    def rows(self) -> Rows:
        """The rotation as rows of a matrix."""
        x, y, z, w = self.q
        return (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )

    def of(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points of the inner frame in the outer one; shape (n, 3), (m)."""
        moved: NDArray[np.float64] = points @ np.array(self.rows).T + self.move
        return moved

    def compose(self, inner: "RigidTransform") -> "RigidTransform":
        """Product: the inner transform's inner frame in this one's outer frame."""
        x, y, z, w = self.q
        a, b, c, d = inner.q
        turned = (
            w * a + x * d + y * c - z * b,
            w * b - x * c + y * d + z * a,
            w * c + x * b - y * a + z * d,
            w * d - x * a - y * b - z * c,
        )
        u, v, t = self._turned(inner.move)
        right, up, out = self.move
        return RigidTransform((u + right, v + up, t + out), turned)

    def inverse(self) -> "RigidTransform":
        """The inverse transform."""
        x, y, z, w = self.q
        back = RigidTransform(q=(-x, -y, -z, w))
        u, v, t = back._turned(self.move)
        return RigidTransform((-u, -v, -t), back.q)

    def _turned(self, point: Three) -> Three:
        """Rotated vector: v + 2 w (q × v) + 2 q × (q × v)."""
        x, y, z, w = self.q
        u, v, t = point
        a, b, c = 2 * (y * t - z * v), 2 * (z * u - x * t), 2 * (x * v - y * u)
        return (
            u + w * a + y * c - z * b,
            v + w * b + z * a - x * c,
            t + w * c + x * b - y * a,
        )

    def flat(self) -> Pose2D:
        """Projection to the floor."""
        x, y, z, w = self.q
        yaw = math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
        return Pose2D(self.move[0], self.move[1], yaw)

    @property
    def tilt(self) -> float:
        """Angle between the two z axes (rad)."""
        x, y, _, _ = self.q
        return math.acos(max(-1.0, min(1.0, 1 - 2 * (x * x + y * y))))

    def towards(self, later: "RigidTransform", part: float) -> "RigidTransform":
        """A share (0 to 1) of the way: linear in position, spherical in rotation."""
        ends = zip(self.move, later.move, strict=True)
        x, y, z = (a + part * (b - a) for a, b in ends)
        return RigidTransform((x, y, z), _slerp(self.q, later.q, part))


IDENTITY = RigidTransform()


def rigid_of(
    translation: ros.Vector3 | ros.Point,
    rotation: ros.Quaternion,
) -> RigidTransform | None:
    """A translation and a quaternion of any length; None for an invalid rotation."""
    move = translation.x, translation.y, translation.z
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not (1e-6 < length < math.inf and all(map(math.isfinite, move))):
        return None
    return RigidTransform(move, (x / length, y / length, z / length, w / length))


def _slerp(a: Four, b: Four, part: float) -> Four:
    cosine = sum(one * other for one, other in zip(a, b, strict=True))
    side = -1.0 if cosine < 0.0 else 1.0
    cosine = abs(cosine)
    if cosine > 0.9995:
        of_a, of_b = 1.0 - part, part
    else:
        angle = math.acos(cosine)
        of_a, of_b = math.sin((1.0 - part) * angle), math.sin(part * angle)
    x, y, z, w = (
        of_a * one + side * of_b * other for one, other in zip(a, b, strict=True)
    )
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


# --- transforms -------------------------------------------------------------------
#
# TF tree of one robot, buffered and interpolated.
#
# Source: REP-105 and ``tf2``'s buffer. Unlike there lookups never wait or extrapolate:
# a transform is interpolated, or is the newest for up to ``max_age_s``, or it is
# missing, with the time since when.

KEPT_S = 10.0
MOST_FRAMES = 256
_MOST_KEPT = 2000
_DEEPEST = 32


class NoTransformError(IvegError):
    """A link of the tree is missing or too old.

    Attributes:
        link: Its two frames: ``map → odom``.
        for_s: Time since the last one (s); None: there never was one.
    """

    def __init__(self, link: str, for_s: float | None) -> None:
        since = "" if for_s is None else f" for {for_s:.1f} s"
        super().__init__(f"no {link}{since}")
        self.link = link
        self.for_s = for_s


@dataclass(frozen=True, slots=True)
class _At:
    """One transform at its stamp (s)."""

    stamp: float
    rigid: RigidTransform


class _Link:
    """Parent of a child frame, with its transforms."""

    def __init__(self, parent: str, *, static: bool) -> None:
        self.parent = parent
        self.static = static
        self.known: deque[_At] = deque(maxlen=_MOST_KEPT)

    def add(self, at: _At) -> bool:
        """Store it; False if it is not newer than the newest."""
        if self.static:
            self.known.clear()
        elif self.known and at.stamp <= self.known[-1].stamp:
            return False
        self.known.append(at)
        while at.stamp - self.known[0].stamp > KEPT_S:
            self.known.popleft()
        return True


class TransformBuffer:
    """Buffer of the tree; stamps are seconds on the clock of the robot's messages.

    Args:
        max_age_s: Greatest lead of a datum over the newest transform (s).
    """

    def __init__(self, max_age_s: float = 0.5) -> None:
        self._max_age_s = max_age_s
        self._links: dict[str, _Link] = {}

    def add(self, message: ros.TFMessage, *, static: bool) -> int:
        """Take a message of ``/tf`` or ``/tf_static``.

        Returns:
            Number of its transforms that are unusable or not new.
        """
        return sum(not self._add(one, static=static) for one in message.transforms)

    def _add(self, one: ros.TransformStamped, *, static: bool) -> bool:
        parent = one.header.frame_id.lstrip("/")
        child = one.child_frame_id.lstrip("/")
        rigid = rigid_of(one.transform.translation, one.transform.rotation)
        if rigid is None or not parent or not child or parent == child:
            return False
        link = self._links.get(child)
        if link is None or link.parent != parent or link.static != static:
            if link is None and len(self._links) >= MOST_FRAMES:
                return False
            link = self._links[child] = _Link(parent, static=static)
        return link.add(_At(one.header.stamp.seconds, rigid))

    def clear(self) -> None:
        """Delete dynamic transforms, since the clock was reset."""
        self._links = {c: one for c, one in self._links.items() if one.static}

    def lookup(self, outer: str, inner: str, stamp: float) -> RigidTransform:
        """Transform from ``inner`` to ``outer`` at a stamp.

        Raises:
            NoTransformError: a link is missing, or old at this stamp.
        """
        up = self.chain(inner)
        if outer in up:  # the usual case
            return self._climb(up[: up.index(outer)], stamp)
        down = self.chain(outer)
        shared = next((frame for frame in up if frame in down), None)
        if shared is None:
            # The missing link leads from the root of one tree to that of the other.
            raise NoTransformError(f"{down[-1]} → {up[-1]}", None)
        here = self._climb(up[: up.index(shared)], stamp)
        there = self._climb(down[: down.index(shared)], stamp)
        return there.inverse().compose(here)

    def chain(self, frame: str) -> list[str]:
        """A frame and all its ancestors."""
        found = [frame]
        while (link := self._links.get(found[-1])) and len(found) < _DEEPEST:
            found.append(link.parent)
        return found

    def _climb(self, frames: Iterable[str], stamp: float) -> RigidTransform:
        rigid: RigidTransform | None = None
        for frame in frames:
            outer = self._at(frame, stamp)
            rigid = outer if rigid is None else outer.compose(rigid)
        return IDENTITY if rigid is None else rigid

    def _at(self, child: str, stamp: float) -> RigidTransform:
        link = self._links[child]
        known = link.known
        if link.static:
            return known[-1].rigid
        newest, oldest = known[-1], known[0]
        if stamp >= newest.stamp:
            if stamp - newest.stamp > self._max_age_s:
                raise NoTransformError(f"{link.parent} → {child}", stamp - newest.stamp)
            return newest.rigid
        if stamp < oldest.stamp:
            if oldest.stamp - stamp > self._max_age_s:
                raise NoTransformError(f"{link.parent} → {child}", None)
            return oldest.rigid
        place = bisect_left(known, stamp, key=lambda one: one.stamp)
        if known[place].stamp == stamp:
            return known[place].rigid
        before, after = known[place - 1], known[place]
        part = (stamp - before.stamp) / (after.stamp - before.stamp)
        return before.rigid.towards(after.rigid, part)
