"""People in the greenhouse: robots' detections become persons on the map.

A detection is placed in ``map``, judged by the rule, recognised as a fleet member where
one stands there, and else handed to the tracker.
"""

from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Literal

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.frames import FramedBox, resolve_box
from iveg.domain.geometry import Pose2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    Instant,
    SafetyReport,
)
from iveg.domain.parameters import Class
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.looks import (
    FAINT_FROM,
    KEPT_FROM,
    MOST_SUSPECTS,
    FaintPerson,
    Looks,
    Suspicions,
)
from iveg.domain.tracking.person import Sighting, Things, TrackedPerson
from iveg.domain.tracking.tracker import PlacedDetection, Tracker, TrackNumbers
from iveg.domain.world import World

LASER = "laser"
"""Stands where a detector's class stands."""
EVEN = 0.5
"""Confidence of what a laser sees walk: it may be a person as well as not."""
_HEIGHT_M = 0.9
_THINNEST_M = 0.01
"""A thinner box has no extent."""
_BEYOND_WALL_M = 2.0


@dataclass(frozen=True, slots=True)
class Placed:
    """A detection in ``map`` with what became of it.

    One whose frame is not known for certain is placed more than once.

    Attributes:
        framed: Its box in the frame that it was taken to be in.
        index: Of the detection in its frame.
        person: The person it belongs to; None when faint, another class, or a peer.
        peer: The fleet member that it is a sighting of.
        looks: All looks at this person; None of a robot, and of one who is too faint.
        possible: Whether it counts by its looks alone, below the threshold.
        doubtful: Outside the greenhouse, so nobody knows where it is: where its
            observer stood, and how far that one sees (m).
    """

    detection: Detection
    framed: FramedBox
    index: int
    position: tuple[float, float, float]
    kind: Literal["alert", "faint", "other"]
    class_: Class | None
    person: TrackedPerson | None = None
    peer: str | None = None
    looks: Looks | None = None
    possible: bool = False
    doubtful: tuple[Pose2D, float] | None = None


class People:
    """Every known person, in the order of appearance.

    Args:
        greenhouse: What is seen beyond its outer wall is of doubtful position.
        era: Ends every id.
    """

    def __init__(self, greenhouse: Greenhouse | None = None, era: str = "") -> None:
        self._bounds = None if greenhouse is None else greenhouse.bounds
        self._suspicions = Suspicions()
        self._tracker = Tracker(numbers=TrackNumbers(era))
        self.things = Things()
        self.turned_away = 0
        """Detections of the last frame without room."""
        self.unplaced = 0
        """Detections of the last frame that may be somebody, with an unknown place or
        an impossible box."""
        self.unknown_frames: frozenset[str] = frozenset()
        """Frames that the last frame named and nobody described."""

    def copy(self) -> "People":
        """Another that knows the same, and takes the same words of operators."""
        shared = self.things, self._bounds
        return deepcopy(self, {id(one): one for one in shared})

    @property
    def known(self) -> dict[str, TrackedPerson]:
        """Everyone, by id."""
        return self._tracker.known

    def sight(
        self,
        frame: DetectionFrame,
        world: World,
        rule: DetectionRule,
        at: Instant,
        new_id: str,
    ) -> list[Placed]:
        """Take one detection frame of one robot in.

        ``at`` is the frame's source moment on our clocks; ``new_id`` begins the
        decision ids of new persons.

        Returns:
            Every detection that could be placed, judged and, if confident, assigned.
        """
        observer = world.robot(frame.robot_id)
        pose = observer.pose_at_stamp(frame.origin.own_s)
        placed = self._place(frame, observer, pose, rule)
        if rule.possible_people:
            placed = self._suspect(placed, observer, rule, at)
        placed = [
            self._doubt(_match_peer(one, observer, world, at), pose, observer)
            for one in placed
        ]
        return self._assign(placed, observer, at, new_id)

    def _place(
        self,
        frame: DetectionFrame,
        observer: RobotState,
        pose: Pose2D | None,
        rule: DetectionRule,
    ) -> list[Placed]:
        """Place every detection wherever it may be, and note those without a place."""
        placed: list[Placed] = []
        unknown, self.unplaced = set[str](), 0
        for index, detection in enumerate(frame.detections):
            is_placed = True
            for box in resolve_box(detection, observer.description):
                if box is not None and (pose is not None or box.frame_id == "map"):
                    placed.append(_placed(detection, box, index, pose, rule))
                    is_placed = is_placed and _is_possible(placed[-1])
                    continue
                is_placed = False
                if box is None and detection.frame_id is not None:
                    unknown.add(detection.frame_id)
            if not is_placed:
                self.unplaced += _may_be_somebody(detection, rule)
        self.unknown_frames = frozenset(unknown)
        return placed

    def _suspect(
        self,
        placed: list[Placed],
        observer: RobotState,
        rule: DetectionRule,
        at: Instant,
    ) -> list[Placed]:
        """Note all looks at everybody; raise faint people whom these confirm."""
        suspects = sorted(filter(_is_suspect, placed), key=_confidence, reverse=True)
        del suspects[MOST_SUSPECTS:]
        seen = [FaintPerson(*one.position[:2], _confidence(one)) for one in suspects]
        least = rule.threshold.of("person")
        known = self._suspicions.look(observer.robot_id, seen, at, least)
        looks = {id(one): found for one, found in zip(suspects, known, strict=True)}
        return [_looked_at(one, looks.get(id(one))) for one in placed]

    def _doubt(self, one: Placed, pose: Pose2D | None, observer: RobotState) -> Placed:
        """Doubt a detection beyond the walls (docs/safety.md, "The rule")."""
        if one.kind != "alert" or one.peer is not None or pose is None:
            return one
        x, y, _ = one.position
        if self._bounds is None or self._bounds.contains(x, y, _BEYOND_WALL_M):
            return one
        return replace(one, doubtful=(pose, observer.profile.camera_range))

    def _assign(
        self, placed: Sequence[Placed], observer: RobotState, at: Instant, new_id: str
    ) -> list[Placed]:
        """Hand confident detections that are no fleet member to the tracker."""
        out = list(placed)
        wanting = [
            index
            for index, one in enumerate(out)
            if one.kind == "alert" and one.peer is None
        ]
        tracks = self._tracker.track_picture(
            [
                PlacedDetection(
                    out[index].class_ or "person",
                    _sighting(out[index], observer, at),
                    f"{new_id}-{index}",
                )
                for index in wanting
            ],
            at,
        )
        self.turned_away = tracks.count(None)
        for index, track in zip(wanting, tracks, strict=True):
            if track is not None:
                out[index] = replace(out[index], person=self.known[track])
        return out

    def witness(
        self,
        report: SafetyReport,
        at: Instant,
        new_id: str,
    ) -> TrackedPerson | None:
        """Take in who walks near a robot by its own laser; ``at``: when it saw them."""
        found = report.obstacle
        if found is None or not found.moved:
            return None
        name, x, y = report.robot_id, found.x, found.y
        seen = Sighting(name, x, y, _HEIGHT_M, at, LASER, EVEN, None, laser=True)
        picture = [PlacedDetection("person", seen, f"{new_id}-0")]
        (track,) = self._tracker.track_picture(picture, at)
        return None if track is None else self.known[track]

    def zone_radii(
        self, person: TrackedPerson, rule: DetectionRule, now: Instant
    ) -> Iterable[tuple[Sighting, float]]:
        """Every zone that protects somebody, with its radius now (m); a thing: none.

        The only way to a person's zones, so that all who ask leave the same ones out.
        """
        if self.things.explain(person, now) is not None:
            return ()
        return person.zone_radii(rule, now)

    def drop_sighting(self, person_id: str, sighting: Sighting) -> TrackedPerson:
        """Drop a sighting whose place its own camera saw to be empty."""
        return self._tracker.drop(person_id, sighting)

    def forget(self, now: Instant) -> list[TrackedPerson]:
        """Drop persons who have not been seen for ten minutes; returns them."""
        return self._tracker.forget(now)


def _placed(
    detection: Detection,
    framed: FramedBox,
    index: int,
    pose: Pose2D | None,
    rule: DetectionRule,
) -> Placed:
    """Place one detection of a robot that stood at ``pose``."""
    x, y, z = framed.box.centre
    if framed.frame_id == "base_link" and pose is not None:
        x, y = pose.transform(x, y)
    verdict = rule.judge(detection.class_id, detection.probability)
    return Placed(detection, framed, index, (x, y, z), verdict.kind, verdict.class_)


def _looked_at(one: Placed, looks: Looks | None) -> Placed:
    """A detection with all looks at it; a faint one counts if these confirm it."""
    if looks is None:
        return one
    possible = one.kind == "faint" and looks.confirmed
    kind = "alert" if possible else one.kind
    return replace(one, kind=kind, looks=looks, possible=possible)


def _is_possible(one: Placed) -> bool:
    """Whether a box is one that something has; of a person also its size."""
    box = one.framed.box
    fits = one.class_ != "person" or (
        box.longer_side <= LIMITS.person_widest_m
        and box.zmax - box.zmin <= LIMITS.person_highest_m
    )
    return fits and box.shorter_side >= _THINNEST_M


def _may_be_somebody(detection: Detection, rule: DetectionRule) -> bool:
    """Whether a detection would slow robots if its place were known."""
    verdict = rule.judge(detection.class_id, detection.probability)
    suspected = verdict.class_ == "person" and detection.probability >= FAINT_FROM
    return verdict.kind == "alert" or (rule.possible_people and suspected)


def _match_peer(one: Placed, observer: RobotState, world: World, at: Instant) -> Placed:
    """Recognise a sighted robot as the fleet member that is there by odometry.

    Only whoever is believed explains a box, and no farther off than a place is wrong:
    its word alone must not take the zone away that others' eyes made.
    """
    if one.class_ != "robot":
        return one
    x, y, _ = one.position
    near = list[tuple[float, str]]()
    for peer in world.robots.values():
        if peer is observer or peer.odometry is None or not peer.is_believed(at):
            continue
        if peer.recording != observer.recording:
            continue
        reach, age = LIMITS.uncertainty_m, peer.age_s(at)
        if peer.description.is_described:
            # Of a body of unknown size one sighting more is safer than one less.
            reach += peer.profile.length / 2
        if age is not None and not peer.stands:
            reach += LIMITS.walking_m_s * age
        residual = peer.odometry.pose.distance_to(x, y)
        if residual <= reach:
            near.append((residual, peer.robot_id))
    return replace(one, peer=min(near)[1]) if near else one


def _sighting(one: Placed, observer: RobotState, at: Instant) -> Sighting:
    x, y, z = one.position
    reach, half = 0.0, one.framed.box.longer_side / 2
    if one.doubtful is not None:
        pose, reach = one.doubtful
        x, y = pose.x, pose.y
    said = one.detection
    return Sighting(
        observer.robot_id,
        x,
        y,
        z,
        at,
        said.class_id,
        said.probability,
        one.looks,
        reach,
        recording=observer.recording,
        possible=one.possible,
        beyond_m=max(0.0, half - LIMITS.person_radius_m),
    )


def _is_suspect(one: Placed) -> bool:
    return one.class_ == "person" and one.detection.probability >= KEPT_FROM


def _confidence(one: Placed) -> float:
    return one.detection.probability
