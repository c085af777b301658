"""Boxes by grounding: from a rendered mask and depth picture, with a robot's own code.

Detection and confidence are drawn as without grounding (``camera``); the position comes
from the picture, by the code that runs on a robot (``robot/grounding``).  Only the part
of the picture about a target is rendered: the rest is not needed.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Detection, Origin
from iveg.lab.emulator.camera import FoundTarget
from iveg.lab.emulator.depth import Upright, person_shape, robot_shape, take_picture
from iveg.lab.emulator.depth_camera import DepthCamera
from iveg.lab.emulator.detector_model import PERSON
from iveg.lab.emulator.foliage import Foliage
from iveg.lab.emulator.greenhouse import Disc, Scenery, into
from iveg.lab.emulator.targets import Target
from iveg.robot.grounding.cloud import Pinhole
from iveg.robot.grounding.locate import Grounding, Mount, ground_frame

_WIDTH, _HEIGHT = 320, 240
"""A quarter of the pixels of a D435, which is enough at 8 m."""
_BESIDE_M = 0.2
"""Margin about a target for its leaves and fringe (m)."""
_NEAREST_M = 0.3
_SETTINGS = Grounding(p_min=0.0, hidden={PERSON: 0.36})
"""A robot reports uncertain detections as well; the threshold is iVeg's."""


class GroundedCamera:
    """One robot's depth camera and the software that locates targets in its pictures.

    Args:
        profile: Where the camera sits and what it sees.
        rng: Random source of noise and leaves.
    """

    def __init__(self, profile: RobotProfile, rng: np.random.Generator) -> None:
        lens = Pinhole.across(profile.camera_fov, _WIDTH, _HEIGHT)
        self._camera = replace(DepthCamera.of(profile), lens=lens)
        self._mount = Mount.of(profile)
        self._rng = rng

    def place(
        self,
        pose: Pose2D,
        found: Sequence[FoundTarget],
        targets: Sequence[Target],
        scenery: Scenery,
    ) -> tuple[tuple[Detection, ...], tuple[str | None, ...]]:
        """Locate detected targets.

        Args:
            pose: The robot's true pose in ``map``.
            found: Detected targets, in the order of the report.
            targets: All objects that may occlude one another.
            scenery: Static occluding objects.

        Returns:
            Boxes in ``base_link``, and the classes of targets without a position.
        """
        placed: list[Detection] = []
        lost: list[str | None] = []
        for one in found:
            others = [each for each in targets if each.key != one.target.key]
            boxes, unplaced = self._one(pose, one, others, scenery)
            placed += boxes
            lost += unplaced
        return tuple(placed), tuple(lost)

    def _one(
        self, pose: Pose2D, one: FoundTarget, others: Sequence[Target], scenery: Scenery
    ) -> tuple[tuple[Detection, ...], tuple[str | None, ...]]:
        sensor = pose.compose(self._mount.pose)
        lens = _about(self._camera, sensor, one.target)
        if lens is None:
            return (), ()
        shapes = [_shape(one.target), *(_shape(other) for other in others)]
        foliage = Foliage() if scenery.rectangles.size else None
        camera = replace(self._camera, lens=lens)
        view = take_picture(camera, sensor, shapes, scenery, foliage, self._rng)
        segment = view.segment(1, one.target.class_id, one.probability)
        if segment is None:
            return (), ()
        frame = ground_frame(
            "", Origin(), [segment], view.depth, self._mount, _SETTINGS
        )
        return frame.detections, frame.unread


def _shape(target: Target) -> tuple[Upright, ...]:
    body = target.body
    if target.class_id != PERSON:
        return robot_shape(body)
    return person_shape(Disc(body.pose.x, body.pose.y, body.width / 2))


def _about(camera: DepthCamera, sensor: Pose2D, target: Target) -> Pinhole | None:
    """Part of the lens that can contain a target; None where it is out of view."""
    lens, body = camera.lens, target.body
    ahead, left = into(sensor, body.pose.x, body.pose.y)
    reach = math.hypot(body.length, body.width) / 2 + _BESIDE_M
    scale = lens.focal / max(ahead - reach, _NEAREST_M)
    columns = _within(
        lens.cx - scale * (left + reach), lens.cx - scale * (left - reach), lens.width
    )
    over = scale * (target.height + _BESIDE_M - camera.height)
    rows = _within(lens.cy - over, lens.cy + scale * camera.height, lens.height)
    if ahead <= 0.0 or columns is None or rows is None:
        return None
    (first, last), (top, bottom) = columns, rows
    cx, cy = lens.cx - first, lens.cy - top
    return Pinhole(last - first, bottom - top, lens.focal, cx, cy)


def _within(low: float, high: float, size: int) -> tuple[int, int] | None:
    """Whole pixels of a picture from ``low`` to ``high``; None if there are none."""
    first, last = max(0, math.floor(low)), min(size, math.ceil(high) + 1)
    return (first, last) if first < last else None
