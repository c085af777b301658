"""Plane geometry in the frames of REP-105, in metres and radians (REP-103).

x points forward, y left, angles grow counter-clockwise.  A ``Pose2D`` is the pose of
one frame in another, such as the laser's in ``base_link``.
"""

import math
from dataclasses import dataclass
from typing import Annotated, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from iveg.domain.wire import Metres, Radians, Speed, digits

_Coordinate = TypeVar("_Coordinate", float, NDArray[np.float64])
"""Coordinate of one point or of several (m)."""


def wrap_angle(angle: float) -> float:
    """Bring an angle (rad) into [-π, π)."""
    return (angle + math.pi) % math.tau - math.pi


@dataclass(frozen=True, slots=True)
class Pose2D:
    """Position (m) and heading (rad) of one frame in another."""

    x: Metres
    y: Metres
    yaw: Annotated[Radians, digits(5)]

    def transform(
        self, x: _Coordinate, y: _Coordinate
    ) -> tuple[_Coordinate, _Coordinate]:
        """Transform points from the inner frame to the outer one (m)."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * x - s * y, self.y + s * x + c * y

    def inverse(
        self, x: _Coordinate, y: _Coordinate
    ) -> tuple[_Coordinate, _Coordinate]:
        """Transform points from the outer frame to the inner one (m)."""
        c, s, dx, dy = math.cos(self.yaw), math.sin(self.yaw), x - self.x, y - self.y
        return c * dx + s * dy, c * dy - s * dx

    def compose(self, inner: "Pose2D") -> "Pose2D":
        """The pose ``inner``, which is in the inner frame, in the outer frame."""
        x, y = self.transform(inner.x, inner.y)
        return Pose2D(x, y, wrap_angle(self.yaw + inner.yaw))

    def interpolate(self, later: "Pose2D", fraction: float) -> "Pose2D":
        """The pose at a ``fraction`` (0 to 1) of the way to ``later``."""
        # The shorter turn: from 179° to −179° the heading passes 180°, not 0°.
        turn = wrap_angle(later.yaw - self.yaw)
        return Pose2D(
            self.x + fraction * (later.x - self.x),
            self.y + fraction * (later.y - self.y),
            wrap_angle(self.yaw + fraction * turn),
        )

    def distance_to(self, x: float, y: float) -> float:
        """Horizontal distance from this pose's origin to a point (m)."""
        return math.hypot(x - self.x, y - self.y)


@dataclass(frozen=True, slots=True)
class Twist2D:
    """Velocity: ``linear_x`` (m/s, forward) and ``angular_z`` (rad/s)."""

    linear_x: Annotated[Speed, Field(alias="linear_velocity")] = 0.0
    angular_z: Annotated[Speed, Field(alias="angular_velocity")] = 0.0


REST = Twist2D()


@dataclass(frozen=True, slots=True)
class Box3D:
    """An axis-aligned box (m) in the frame that its owner names."""

    xmin: Metres
    xmax: Metres
    ymin: Metres
    ymax: Metres
    zmin: Metres
    zmax: Metres

    @property
    def centre(self) -> tuple[float, float, float]:
        """The centroid c₃D of the paper's grounding equations."""
        return (
            (self.xmin + self.xmax) / 2,
            (self.ymin + self.ymax) / 2,
            (self.zmin + self.zmax) / 2,
        )

    @property
    def shorter_side(self) -> float:
        """The shorter of both horizontal sides (m), where z is up."""
        return min(self.xmax - self.xmin, self.ymax - self.ymin)

    @property
    def longer_side(self) -> float:
        """The longer of both horizontal sides (m), where z is up."""
        return max(self.xmax - self.xmin, self.ymax - self.ymin)


PERSON_RADIUS_M, PERSON_HEIGHT_M = 0.25, 1.75


def person_box(x: float, y: float) -> Box3D:
    """A box of a person's size on the floor about a position (m)."""
    r = PERSON_RADIUS_M
    return Box3D(x - r, x + r, y - r, y + r, 0.0, PERSON_HEIGHT_M)


@dataclass(frozen=True, slots=True)
class Rectangle:
    """An axis-aligned rectangle in ``map`` (m): a crop row, a crate, a lane."""

    xmin: float
    ymin: float
    xmax: float
    ymax: float

    @property
    def middle(self) -> tuple[float, float]:
        """Its centre, in ``map`` (m)."""
        return (self.xmin + self.xmax) / 2, (self.ymin + self.ymax) / 2

    def joined(self, other: "Rectangle") -> "Rectangle":
        """The smallest rectangle that contains both."""
        return Rectangle(
            min(self.xmin, other.xmin),
            min(self.ymin, other.ymin),
            max(self.xmax, other.xmax),
            max(self.ymax, other.ymax),
        )

    def farthest_m(self, x: float, y: float) -> float:
        """Distance of its farthest corner from a spot (m)."""
        return math.hypot(
            max(x - self.xmin, self.xmax - x), max(y - self.ymin, self.ymax - y)
        )

    def contains(self, x: float, y: float, margin: float = 0.0) -> bool:
        """Whether a point lies inside, the rectangle grown by ``margin`` (m)."""
        return (
            self.xmin - margin <= x <= self.xmax + margin
            and self.ymin - margin <= y <= self.ymax + margin
        )

    def crosses(self, ax: float, ay: float, bx: float, by: float) -> bool:
        """Whether the segment a-b crosses the rectangle (slab method)."""
        low, high = 0.0, 1.0
        for start, end, least, most in (
            (ax, bx, self.xmin, self.xmax),
            (ay, by, self.ymin, self.ymax),
        ):
            span = end - start
            if span == 0.0:
                if not least <= start <= most:
                    return False
                continue
            near, far = sorted(((least - start) / span, (most - start) / span))
            low, high = max(low, near), min(high, far)
        return low <= high
