"""Frames of one robot: rigid transforms, and the TF tree that holds them."""

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import IvegError
from iveg.domain.geometry import Pose2D
from iveg.ros2 import messages as ros

# --- rigid ------------------------------------------------------------------------

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class RigidTransform:
    """Pose of a frame in another.

    Attributes:
        matrix: Shape (4, 4); p_outer = matrix · p_inner, homogeneous (m).
    """

    matrix: Matrix

    @property
    def move(self) -> tuple[float, float, float]:
        """Position of the inner frame's origin (m)."""
        x, y, z = self.matrix[:3, 3].tolist()
        return x, y, z

    def apply(self, points: Matrix) -> Matrix:
        """Points of the inner frame in the outer one; shape (n, 3), (m)."""
        moved: Matrix = points @ self.matrix[:3, :3].T + self.matrix[:3, 3]
        return moved

    def compose(self, inner: "RigidTransform") -> "RigidTransform":
        """Product: the inner transform's inner frame in this one's outer frame."""
        return RigidTransform(self.matrix @ inner.matrix)

    def inverse(self) -> "RigidTransform":
        """The inverse transform."""
        back = np.eye(4)
        back[:3, :3] = self.matrix[:3, :3].T
        back[:3, 3] = -back[:3, :3] @ self.matrix[:3, 3]
        return RigidTransform(back)

    def flat(self) -> Pose2D:
        """Projection to the floor."""
        x, y, _ = self.move
        return Pose2D(x, y, math.atan2(self.matrix[1, 0], self.matrix[0, 0]))

    @property
    def tilt(self) -> float:
        """Angle between the two z axes (rad)."""
        return math.acos(max(-1.0, min(1.0, self.matrix[2, 2])))

    def towards(self, later: "RigidTransform", part: float) -> "RigidTransform":
        """Transform at a share (0 to 1) of the way to a later one; for small turns."""
        between = (1.0 - part) * self.matrix + part * later.matrix
        # The rotation nearest to the mean of two.
        left, _, right = np.linalg.svd(between[:3, :3])
        between[:3, :3] = left @ right
        return RigidTransform(between)


IDENTITY = RigidTransform(np.eye(4))


def rigid_of(
    translation: ros.Vector3 | ros.Point, rotation: ros.Quaternion
) -> RigidTransform | None:
    """A translation and a quaternion of any length; None for an invalid rotation."""
    move = translation.x, translation.y, translation.z
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    square = x * x + y * y + z * z + w * w
    if not (1e-12 < square < math.inf and all(map(math.isfinite, move))):
        return None
    # Rodrigues' formula, with the quaternion's vector as a cross product.
    cross = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    matrix = np.eye(4)
    matrix[:3, :3] += 2.0 / square * (w * cross + cross @ cross)
    matrix[:3, 3] = move
    return RigidTransform(matrix)


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
        self.known: deque[_At] = deque(maxlen=1 if static else _MOST_KEPT)

    def add(self, at: _At) -> None:
        """Store a transform that is static, or newer than the newest."""
        if self.known and not self.static and at.stamp <= self.known[-1].stamp:
            return
        self.known.append(at)
        while at.stamp - self.known[0].stamp > KEPT_S:
            self.known.popleft()


class TransformBuffer:
    """Buffer of the tree; stamps are seconds on the clock of the robot's messages.

    Args:
        max_age_s: Greatest lead of a datum over the newest transform (s).
    """

    def __init__(self, max_age_s: float = 0.5) -> None:
        self._max_age_s = max_age_s
        self._links: dict[str, _Link] = {}

    def add(self, message: ros.TFMessage, *, static: bool) -> None:
        """Take a message of ``/tf`` or ``/tf_static``; unusable links are left out."""
        for transform in message.transforms:
            self._add(transform, static=static)

    def _add(self, stamped: ros.TransformStamped, *, static: bool) -> None:
        parent = stamped.header.frame_id.lstrip("/")
        child = stamped.child_frame_id.lstrip("/")
        rigid = rigid_of(stamped.transform.translation, stamped.transform.rotation)
        if rigid is None or not parent or not child or parent == child:
            return
        link = self._links.get(child)
        # Anything on the network may publish frames: they must not fill the memory.
        if link is None and len(self._links) >= MOST_FRAMES:
            return
        if link is None or link.parent != parent or link.static != static:
            link = self._links[child] = _Link(parent, static=static)
        link.add(_At(stamped.header.stamp.seconds, rigid))

    def clear(self) -> None:
        """Delete dynamic transforms, since the clock was reset."""
        self._links = {c: link for c, link in self._links.items() if link.static}

    def lookup(self, outer: str, inner: str, stamp: float) -> RigidTransform:
        """Transform from ``inner`` to ``outer`` at a stamp.

        Raises:
            NoTransformError: a link is missing, or old at this stamp.
        """
        up, down = self.chain(inner), self.chain(outer)
        shared = next((frame for frame in up if frame in down), None)
        if shared is None:
            # The missing link leads from the root of one tree to that of the other.
            raise NoTransformError(f"{down[-1]} → {up[-1]}", None)
        here = self._climb(up[: up.index(shared)], stamp)
        there = self._climb(down[: down.index(shared)], stamp)
        return there.inverse().compose(here)

    def chain(self, frame: str) -> list[str]:
        """A frame and all its ancestors."""
        frames = [frame]
        # Bounded, as a broken tree may have a loop.
        while (link := self._links.get(frames[-1])) and len(frames) < _DEEPEST:
            frames.append(link.parent)
        return frames

    def _climb(self, frames: Iterable[str], stamp: float) -> RigidTransform:
        """Pose of the first of these frames in the parent of the last."""
        links = (self._at(frame, stamp) for frame in frames)
        return reduce(lambda inner, outer: outer.compose(inner), links, IDENTITY)

    def _at(self, child: str, stamp: float) -> RigidTransform:
        link = self._links[child]
        known, name = link.known, f"{link.parent} → {child}"
        newest, oldest = known[-1], known[0]
        if link.static or newest.stamp <= stamp <= newest.stamp + self._max_age_s:
            return newest.rigid
        if stamp > newest.stamp:
            raise NoTransformError(name, stamp - newest.stamp)
        if stamp < oldest.stamp - self._max_age_s:
            raise NoTransformError(name, None)
        place = bisect_left(known, stamp, key=lambda at: at.stamp)
        after, before = known[place], known[max(0, place - 1)]
        if place == 0 or after.stamp == stamp:
            return after.rigid
        part = (stamp - before.stamp) / (after.stamp - before.stamp)
        return before.rigid.towards(after.rigid, part)
