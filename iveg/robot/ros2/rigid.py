"""Rigid transforms between frames, in plain numbers.

NumPy is slower for so few numbers; a matrix is made to transform many points.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.ros2 import geometry_msgs

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
    translation: geometry_msgs.Vector3 | geometry_msgs.Point,
    rotation: geometry_msgs.Quaternion,
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
