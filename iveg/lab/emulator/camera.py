"""Emulated camera and detector: targets in view, and what the paper's detector reports.

Nothing is rendered unless ``grounded`` locates the targets.  A target in the field of
view, in range and not hidden by crop or crates opens an *encounter* of 0.5 to 2 s;
a miss, the confidence and a possible false box are drawn once per encounter, so that
errors last as long as real ones and do not flicker between two frames.

Assumed: the length of an encounter.  The rates are those of ``detector_model``.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import (
    Box3D,
    Pose2D,
    box_of_a_person,
    wrap_angle,
)
from iveg.domain.observations import Detection
from iveg.lab.emulator.detector_model import DetectorModel
from iveg.lab.emulator.greenhouse import Body, Scenery, into
from iveg.lab.emulator.targets import Target

_NEAREST_M = 0.3
_LONGEST_S, _SHORTEST_S = 2.0, 0.5
_GHOST_NEAR_M, _GHOST_FAR_M = 2.0, 6.0
_HIDDEN_LOSS = 0.15
"""Loss of confidence for a target that is almost fully hidden."""


@dataclass(frozen=True, slots=True)
class _Ghost:
    """A false box at a position in ``map``."""

    class_id: str
    x: float
    y: float
    confidence: float


@dataclass(frozen=True, slots=True)
class _Encounter:
    """Random draws for one target, valid for one encounter."""

    until: float
    missed: bool
    confidence: float
    offset: tuple[float, float]
    ghost: _Ghost | None


@dataclass(frozen=True, slots=True)
class FoundTarget:
    """A detected target and its confidence (0 to 1)."""

    target: Target
    probability: float


Place = Callable[
    [Pose2D, Sequence[FoundTarget], Sequence[Target], Scenery],
    tuple[tuple[Detection, ...], tuple[str | None, ...]],
]
"""Locates detected targets: boxes, and the number of targets without a position."""


class EmulatedDetector:
    """Camera of one robot with its detector.

    Args:
        profile: Where the camera sits and what it sees.
        model: How good the network is.
        rng: Random source of its errors.
        place: Locates detected targets; None draws boxes about the truth.

    Attributes:
        lost: Classes of the targets of the last frame that have no position.
        name: Of the network, as its frames tell it.
    """

    def __init__(
        self,
        profile: RobotProfile,
        model: DetectorModel,
        rng: np.random.Generator,
        place: Place | None = None,
    ) -> None:
        self.lost: tuple[str | None, ...] = ()
        self.name = model.name
        self._place = place
        self._profile = profile
        self._model = model
        self._rng = rng
        self._encounters: dict[str, _Encounter] = {}

    def detect(
        self, now: float, pose: Pose2D, targets: Sequence[Target], scenery: Scenery
    ) -> tuple[Detection, ...]:
        """One frame.

        Args:
            now: Seconds into the run.
            pose: The robot's true pose in ``map``.
            targets: People and the other robots.
            scenery: Occluding objects.

        Returns:
            Boxes in ``base_link``.
        """
        camera = pose.compose(self._profile.camera)
        drawn: list[Detection] = []
        found: list[FoundTarget] = []
        for target in targets:
            seen = self.part_seen(camera, target.body, scenery)
            encounter = self._encounter(now, camera, target, seen > 0.0)
            if encounter is None:
                continue
            if seen > 0.0 and not encounter.missed:
                if self._place is None:
                    drawn.append(self._box(pose, target, encounter, seen))
                else:
                    found.append(FoundTarget(target, self._certainty(encounter, seen)))
            if encounter.ghost is not None:
                drawn.append(self._ghost_box(pose, encounter.ghost))
        if self._place is None or not found:
            self.lost = ()
            return tuple(drawn)
        placed, self.lost = self._place(pose, found, targets, scenery)
        return (*placed, *drawn)

    # --- what is in view ----------------------------------------------------------

    def part_seen(self, camera: Pose2D, body: Body, scenery: Scenery) -> float:
        """Visible share of a target from ``camera``: 0, 1/3, 2/3 or 1."""
        x, y = body.pose.x, body.pose.y
        distance = camera.distance_to(x, y)
        if not _NEAREST_M < distance <= self._profile.camera_range:
            return 0.0
        bearing = wrap_angle(math.atan2(y - camera.y, x - camera.x) - camera.yaw)
        if abs(bearing) > self._profile.camera_fov / 2:
            return 0.0
        half = body.width / 2 / distance
        side_x, side_y = -(y - camera.y) * half, (x - camera.x) * half
        places = ((x + k * side_x, y + k * side_y) for k in (-0.9, 0.0, 0.9))
        return sum(not scenery.hides(camera.x, camera.y, *p) for p in places) / 3

    # --- detections ---------------------------------------------------------------

    def _encounter(
        self, now: float, camera: Pose2D, target: Target, visible: bool
    ) -> _Encounter | None:
        """The running encounter; a new one when it is over and the target in view."""
        running = self._encounters.get(target.key)
        if running is not None and now < running.until:
            return running
        self._encounters.pop(target.key, None)
        if not visible:
            return None
        fresh = self._draw(now, camera, target)
        self._encounters[target.key] = fresh
        return fresh

    def _draw(self, now: float, camera: Pose2D, target: Target) -> _Encounter:
        counts, rng, model = (
            self._model.counts_of(target.class_id),
            self._rng,
            self._model,
        )
        until = now + rng.uniform(_SHORTEST_S, _LONGEST_S)
        missed = rng.random() < counts.miss_rate
        confidence = rng.normal(model.confidence, model.spread)
        x, y = rng.normal(0.0, model.position, 2)
        ghost = None
        if rng.random() < counts.ghost_rate:
            ghost = self._draw_ghost(camera, target.class_id)
        return _Encounter(until, missed, confidence, (float(x), float(y)), ghost)

    def _draw_ghost(self, camera: Pose2D, class_id: str) -> _Ghost:
        half = self._profile.camera_fov / 2
        bearing = self._rng.uniform(-half, half)
        distance = self._rng.uniform(_GHOST_NEAR_M, _GHOST_FAR_M)
        x, y = camera.transform(
            distance * math.cos(bearing), distance * math.sin(bearing)
        )
        mean = self._model.confidence - self._model.ghost_confidence
        return _Ghost(class_id, x, y, self._rng.normal(mean, self._model.spread))

    # --- boxes --------------------------------------------------------------------

    def _box(
        self, pose: Pose2D, target: Target, encounter: _Encounter, seen: float
    ) -> Detection:
        jitter = self._rng.normal(0.0, self._model.jitter, 2)
        moved = target.body.corners() + encounter.offset + jitter
        corners = [into(pose, float(x), float(y)) for x, y in moved]
        xs, ys = [x for x, _ in corners], [y for _, y in corners]
        box = Box3D(min(xs), max(xs), min(ys), max(ys), 0.0, target.height)
        certainty = self._certainty(encounter, seen)
        return Detection(target.class_id, certainty, box, "base_link")

    def _certainty(self, encounter: _Encounter, seen: float) -> float:
        return self._probability(encounter.confidence - _HIDDEN_LOSS * (1.0 - seen))

    def _ghost_box(self, pose: Pose2D, ghost: _Ghost) -> Detection:
        probability = self._probability(ghost.confidence)
        return upright_box(pose, ghost.class_id, ghost.x, ghost.y, probability)

    def _probability(self, confidence: float) -> float:
        flickering = confidence + self._rng.normal(0.0, self._model.flicker)
        return float(min(max(flickering, 0.05), 0.99))


def upright_box(
    pose: Pose2D, class_id: str, x: float, y: float, probability: float
) -> Detection:
    """A box of a person's size at a position in ``map``, given in ``base_link``."""
    box = box_of_a_person(*into(pose, x, y))
    return Detection(class_id, probability, box, "base_link")
