"""Pictures of a depth camera: people, robots, crop and leaves with their occlusion.

Everything is upright on a flat floor - a footprint from one height to another - so a
pixel's ray meets it where its column meets the footprint and its row the heights: two
small problems instead of 307,200.  Depth runs along the optical axis (m).

Left out: arms and legs, lens distortion, shadows of the second imager, flying pixels.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import PERSON_HEIGHT_M, Pose2D
from iveg.lab.emulator.depth_camera import DepthCamera
from iveg.lab.emulator.depth_errors import with_errors
from iveg.lab.emulator.foliage import Foliage, hang_leaves
from iveg.lab.emulator.greenhouse import (
    Body,
    Disc,
    Floats,
    Scenery,
    Span,
    box_span,
    sides_of,
    slab_span,
)
from iveg.lab.emulator.targets import ROBOT_HEIGHT_M
from iveg.robot.grounding.cloud import DepthPicture
from iveg.robot.grounding.locate import Segment
from iveg.robot.grounding.mask import Mask, write_mask

_CROP_HEIGHT_M = 2.0
_SHOULDERS_M = 1.5
_HEAD_RADIUS_M = 0.1


@dataclass(frozen=True, slots=True)
class Upright:
    """A footprint from one height to another (m)."""

    footprint: Disc | Body
    bottom: float
    top: float


@dataclass(frozen=True, slots=True, eq=False)
class DepthView:
    """A rendered picture.

    Attributes:
        depth: As measured (m).
        instances: Shape (height, width); 0 scenery, n the n-th target from 1.
        leaked: Likewise, leaves that the mask network assigns to the n-th target.
    """

    depth: DepthPicture
    instances: NDArray[np.int16]
    leaked: NDArray[np.int16]

    def segment(self, number: int, class_id: str, probability: float) -> Segment | None:
        """Output of detector and mask network for target ``number``; None if unseen."""
        mask: Mask = (self.instances == number) | (self.leaked == number)
        if not (self.instances == number).any():
            return None
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        top, bottom = int(rows[0]), int(rows[-1]) + 1
        left, right = int(columns[0]), int(columns[-1]) + 1
        return Segment(
            class_id,
            probability,
            (left + right) / 2,
            (top + bottom) / 2,
            right - left,
            bottom - top,
            write_mask(mask[top:bottom, left:right]),
        )


def person_shape(person: Disc) -> tuple[Upright, ...]:
    """A body and a head."""
    head = Disc(person.x, person.y, _HEAD_RADIUS_M)
    return (
        Upright(person, 0.0, _SHOULDERS_M),
        Upright(head, _SHOULDERS_M, PERSON_HEIGHT_M),
    )


def robot_shape(body: Body) -> tuple[Upright, ...]:
    """A box."""
    return (Upright(body, 0.0, ROBOT_HEIGHT_M),)


def take_picture(
    camera: DepthCamera,
    sensor: Pose2D,
    targets: Sequence[tuple[Upright, ...]],
    scenery: Scenery,
    foliage: Foliage | None,
    rng: np.random.Generator,
) -> DepthView:
    """Render one picture.

    Args:
        camera: Its data sheet.
        sensor: Its pose in ``map``.
        targets: Visible objects; the first is number 1 of ``DepthView.instances``.
        scenery: Static objects.
        foliage: Leaves about every target; None where nothing grows.
        rng: Random source of leaves and noise.
    """
    rays = _Rays.of(camera, sensor)
    depth = _background(rays, sensor, scenery)
    instances = np.zeros(depth.shape, np.int16)
    for number, shape in enumerate(targets, start=1):
        for part in shape:
            seen = _paint(rays, sensor, part, depth)
            instances[seen] = number
    leaked = np.zeros_like(instances)
    if foliage is not None:
        for number in range(1, len(targets) + 1):
            hang_leaves(camera.lens, foliage, number, depth, instances, leaked, rng)
    measured = with_errors(camera, depth, rng)
    return DepthView(DepthPicture(camera.lens, measured), instances, leaked)


# --- rays -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class _Rays:
    """Directions whose length along the optical axis is one, so that t is depth.

    Attributes:
        across: Shape (2, width): each column's direction on the floor, in ``map``.
        up: Shape (height,): each row's slope.
        height: Of the camera (m).
    """

    across: Floats
    up: Floats
    height: float

    @classmethod
    def of(cls, camera: DepthCamera, sensor: Pose2D) -> "_Rays":
        lens = camera.lens
        left = (lens.cx - np.arange(lens.width, dtype=np.float64)) / lens.focal
        up = (lens.cy - np.arange(lens.height, dtype=np.float64)) / lens.focal
        c, s = math.cos(sensor.yaw), math.sin(sensor.yaw)
        across: Floats = np.stack((c - s * left, s + c * left))
        return cls(across, up, camera.height)


def _background(rays: _Rays, sensor: Pose2D, scenery: Scenery) -> Floats:
    """Depth of floor, wall and crop."""
    wall = box_span(rays.across, sensor, sides_of(scenery.bounds))[1]
    depth = np.minimum(wall[None, :], _height_span(rays, 0.0, math.inf)[1][:, None])
    for xmin, ymin, xmax, ymax in scenery.rectangles:
        centre = Pose2D((xmin + xmax) / 2, (ymin + ymax) / 2, 0.0)
        crop = Body("crop", centre, xmax - xmin, ymax - ymin)
        _paint(rays, sensor, Upright(crop, 0.0, _CROP_HEIGHT_M), depth)
    for x, y, radius in scenery.posts:
        _paint(rays, sensor, Upright(Disc(x, y, radius), 0.0, math.inf), depth)
    return depth


def _paint(rays: _Rays, sensor: Pose2D, thing: Upright, depth: Floats) -> Mask:
    """Shorten ``depth`` where an object stands in front; returns where it does."""
    enter, leave = _footprint_span(rays.across, sensor, thing.footprint)
    columns = np.flatnonzero((enter <= leave) & (leave > 0.0))
    seen = np.zeros(depth.shape, np.bool_)
    if not columns.size:
        return seen
    low, high = _height_span(rays, thing.bottom, thing.top)
    near = np.maximum(enter[columns], low[:, None])
    far = np.minimum(leave[columns], high[:, None])
    hit = (near <= far) & (near > 0.0) & (near < depth[:, columns])
    seen[:, columns] = hit
    depth[:, columns] = np.where(hit, near, depth[:, columns])
    return seen


def _footprint_span(across: Floats, sensor: Pose2D, footprint: Disc | Body) -> Span:
    if isinstance(footprint, Disc):
        return _disc_span(across, sensor, footprint)
    return footprint.span(across, sensor)


def _disc_span(across: Floats, sensor: Pose2D, disc: Disc) -> Span:
    """The quadratic of a ray and a circle."""
    x, y = sensor.x - disc.x, sensor.y - disc.y
    a = (across**2).sum(axis=0)
    b = x * across[0] + y * across[1]
    inside = b**2 - a * (x**2 + y**2 - disc.radius**2)
    root = np.sqrt(np.maximum(inside, 0.0))
    miss = inside < 0.0
    return np.where(miss, np.inf, (-b - root) / a), np.where(
        miss, -np.inf, (root - b) / a
    )


def _height_span(rays: _Rays, bottom: float, top: float) -> Span:
    return slab_span(rays.up, bottom - rays.height, top - rays.height)


# --- leaves -----------------------------------------------------------------------


# --- what is measured -------------------------------------------------------------
