"""Emulated camera and detector: targets in view, and what the paper's detector reports.

Nothing is rendered.  A target in the field of view, in range and not hidden by crop or
crates opens an *encounter* of 0.5 to 2 s; a miss, the confidence and a possible false
box are drawn once per encounter, so that errors last as long as real ones and do not
flicker between two frames.

Source of the rates: the seed paper's field table (true positives, false positives,
false negatives per class).  Assumed: the length of an encounter, the spread of
confidence, and that false boxes are less sure than true ones.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import (
    PERSON_HEIGHT_M,
    Box3D,
    Pose2D,
    person_box,
    wrap_angle,
)
from iveg.domain.observations import Detection
from iveg.lab.emulator.greenhouse import Body, Disc, Scenery

PERSON = "farmer"


@dataclass(frozen=True, slots=True)
class Counts:
    """Counts of one class in the paper's field table."""

    true_positives: int
    false_positives: int
    false_negatives: int

    @property
    def encounters(self) -> int:
        """Number of encounters with a target of the class."""
        return self.true_positives + self.false_negatives


FIELD_COUNTS: Mapping[str, Counts] = {
    PERSON: Counts(36, 6, 3),
    "AGI": Counts(34, 8, 5),
    "AGII": Counts(28, 12, 8),
}


_FAULTLESS = Counts(1, 0, 0)


@dataclass(frozen=True, slots=True)
class DetectorModel:
    """Error model of a detector.

    Attributes:
        confidence: Mean over encounters (0 to 1); ``spread`` its deviation.
        flicker: Deviation from frame to frame.
        ghost_confidence: Loss of confidence of false boxes (0 to 1).
        position: Deviation of a box for an encounter (m); ``jitter`` per frame (m).
        counts: By class; other classes have the counts of ``AGI``.
        name: Name in its frames; None: they have none.
    """

    confidence: float
    spread: float = 0.05
    flicker: float = 0.01
    ghost_confidence: float = 0.10
    position: float = 0.05
    jitter: float = 0.01
    counts: Mapping[str, Counts] = field(default_factory=lambda: FIELD_COUNTS)
    name: str | None = None

    def counts_of(self, class_id: str) -> Counts:
        """The rates for a class."""
        return self.counts.get(class_id, self.counts.get("AGI", _FAULTLESS))


DETECTORS: Mapping[str, DetectorModel] = {
    "field": DetectorModel(0.72, name="field"),
    "simulation": DetectorModel(0.85, spread=0.03, name="simulation"),
    "noisy": DetectorModel(0.80, 0.06, 0.06, 0.0, 0.10, 0.05, {}),
    "perfect": DetectorModel(0.95, 0.0, 0.0, 0.0, 0.0, 0.0, {}),
}

ROBOT_HEIGHT_M = 1.2


@dataclass(frozen=True, slots=True)
class Target:
    """An object that a detector may detect.

    Attributes:
        key: Unique id.
        class_id: As the paper's detector names it.
        body: Its outline; a person's is a square.
    """

    key: str
    class_id: str
    body: Body
    height: float


def person_target(number: int, person: Disc) -> Target:
    """A person as a target."""
    pose, size = Pose2D(person.x, person.y, 0.0), 2 * person.radius
    body = Body(f"person-{number}", pose, size, size)
    return Target(body.robot_id, PERSON, body, PERSON_HEIGHT_M)


def robot_target(body: Body) -> Target:
    """A robot as a target: the class is its id, as in the paper."""
    return Target(body.robot_id, body.robot_id, body, ROBOT_HEIGHT_M)


_NEAREST_M = 0.3
_LONGEST_S, _SHORTEST_S = 2.0, 0.5
_GHOST_NEAR_M, _GHOST_FAR_M = 2.0, 6.0
_HIDDEN_LOSS = 0.15
"""Loss of confidence for a target that is almost fully hidden."""


@dataclass(frozen=True, slots=True)
class _Ghost:
    """A false box of a target's class, at a position in ``map``."""

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


class EmulatedDetector:
    """Camera of one robot with its detector.

    Args:
        profile: Mount, view and range of the camera.
        model: Errors of the network.
        rng: Random source of its errors.

    Attributes:
        name: Name of the network in its frames.
    """

    def __init__(
        self,
        profile: RobotProfile,
        model: DetectorModel,
        rng: np.random.Generator,
    ) -> None:
        self.name = model.name
        self._profile = profile
        self._model = model
        self._rng = rng
        self._encounters: dict[str, _Encounter | None] = {}

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
        detections: list[Detection] = []
        for target in targets:
            part = self.part_in_view(camera, target.body, scenery)
            encounter = self._encounter(now, camera, target, part > 0.0)
            if encounter is None:
                continue
            if part > 0.0 and not encounter.missed:
                detections.append(self._box(pose, target, encounter, part))
            if encounter.ghost is not None:
                ghost = encounter.ghost
                sure = self._probability(ghost.confidence)
                box = person_box(*pose.inverse(ghost.x, ghost.y))
                detections.append(Detection(target.class_id, sure, box, "base_link"))
        return tuple(detections)

    # --- view ---------------------------------------------------------------------

    def part_in_view(self, camera: Pose2D, body: Body, scenery: Scenery) -> float:
        """Visible share of a target from ``camera``: 0, 1/3, 2/3 or 1."""
        x, y = body.pose.x, body.pose.y
        distance = camera.distance_to(x, y)
        if not _NEAREST_M < distance <= self._profile.camera_range:
            return 0.0
        bearing = wrap_angle(math.atan2(y - camera.y, x - camera.x) - camera.yaw)
        if abs(bearing) > self._profile.camera_fov / 2:
            return 0.0
        # Across the line of sight: the middle and almost both sides of the target.
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
        if running is None or now >= running.until:
            running = self._draw(now, camera, target) if visible else None
            self._encounters[target.key] = running
        return running

    def _draw(self, now: float, camera: Pose2D, target: Target) -> _Encounter:
        rng, model = self._rng, self._model
        counts = model.counts_of(target.class_id)
        until = now + rng.uniform(_SHORTEST_S, _LONGEST_S)
        is_missed = rng.random() < counts.false_negatives / counts.encounters
        confidence = rng.normal(model.confidence, model.spread)
        x, y = rng.normal(0.0, model.position, 2)
        has_ghost = rng.random() < counts.false_positives / counts.encounters
        ghost = self._draw_ghost(camera) if has_ghost else None
        return _Encounter(until, is_missed, confidence, (float(x), float(y)), ghost)

    def _draw_ghost(self, camera: Pose2D) -> _Ghost:
        half = self._profile.camera_fov / 2
        bearing = self._rng.uniform(-half, half)
        distance = self._rng.uniform(_GHOST_NEAR_M, _GHOST_FAR_M)
        x, y = camera.transform(
            distance * math.cos(bearing), distance * math.sin(bearing)
        )
        mean = self._model.confidence - self._model.ghost_confidence
        return _Ghost(x, y, self._rng.normal(mean, self._model.spread))

    # --- boxes --------------------------------------------------------------------

    def _box(
        self, pose: Pose2D, target: Target, encounter: _Encounter, part: float
    ) -> Detection:
        jitter = self._rng.normal(0.0, self._model.jitter, 2)
        moved = target.body.corners() + encounter.offset + jitter
        corners = [pose.inverse(float(x), float(y)) for x, y in moved]
        xs, ys = [x for x, _ in corners], [y for _, y in corners]
        box = Box3D(min(xs), max(xs), min(ys), max(ys), 0.0, target.height)
        certainty = encounter.confidence - _HIDDEN_LOSS * (1.0 - part)
        probability = self._probability(certainty)
        return Detection(target.class_id, probability, box, "base_link")

    def _probability(self, confidence: float) -> float:
        flickering = confidence + self._rng.normal(0.0, self._model.flicker)
        return float(min(max(flickering, 0.05), 0.99))
