"""People in the greenhouse: robots' detections become persons on the map.

A judged detection is placed in ``map``, recognised as a fleet member where one stands
there, and else handed to the tracker.
"""

from collections.abc import Iterable, Sequence
from copy import deepcopy
from typing import Literal, NamedTuple

from iveg.domain.detection_rule import DetectionRule, RuleVerdict
from iveg.domain.detector import JudgedFrame
from iveg.domain.frames import FramedBox, resolve_box
from iveg.domain.geometry import Pose2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Detection, Instant, SafetyReport
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
from iveg.domain.tracking.things import Things
from iveg.domain.tracking.tracker import (
    PlacedDetection,
    Sighting,
    TrackedPerson,
    Tracker,
    TrackNumbers,
)
from iveg.domain.world import World

LASER = "laser"
"""Class id of a person whom only a laser saw."""
EVEN = 0.5
"""Confidence of a walking laser track: it is as likely a person as not."""
_HEIGHT_M = 0.9
_THINNEST_M = 0.01
"""A thinner box has no extent."""
_BEYOND_WALL_M = 2.0


class Placed(NamedTuple):
    """A detection in ``map``, judged, matched and assigned.

    A detection in an uncertain frame is placed once for each candidate.

    Attributes:
        framed: Its box in the assumed frame.
        position: Centre in ``map`` (m).
        is_known: Whether its word means anything.
        is_beyond: Whether it lies more than 2 m outside the greenhouse.
        person: The person it belongs to; None when faint, another class, or a peer.
        peer: Fleet member that it shows.
        looks: All looks at this person; None for a robot, and for a person too faint.
        possible: Whether it counts by its looks alone, below the threshold.
        doubtful: Pose and camera range (m) of the observer, where the detection lies
            beyond the walls, so that its place is in doubt; else None.
    """

    detection: Detection
    framed: FramedBox
    position: tuple[float, float, float]
    kind: Literal["alert", "faint", "other"]
    class_: Class | None
    is_known: bool
    is_beyond: bool
    person: TrackedPerson | None = None
    peer: str | None = None
    looks: Looks | None = None
    possible: bool = False
    doubtful: tuple[Pose2D, float] | None = None


class People:
    """Every known person, in the order of appearance.

    Args:
        greenhouse: The greenhouse; a detection beyond its walls has a doubtful place.
        era: Last part of every id.
    """

    def __init__(self, greenhouse: Greenhouse | None = None, era: str = "") -> None:
        self._bounds = None if greenhouse is None else greenhouse.bounds
        self._suspicions = Suspicions()
        self._tracker = Tracker(numbers=TrackNumbers(era))
        self.things = Things()
        self.turned_away = 0
        """Number of detections of the last frame for which there was no room."""
        self.unplaced = 0
        """Number of detections of the last frame that may be somebody and have no place
        or an impossible box."""
        self.unknown_frames: frozenset[str] = frozenset()
        """Names of frames of reference in the last frame that nobody described."""

    def copy(self) -> "People":
        """Copy that knows the same people and shares the marks of operators."""
        # ``deepcopy`` shares the parts in its memo.
        shared = self.things, self._bounds
        return deepcopy(self, {id(part): part for part in shared})

    @property
    def known(self) -> dict[str, TrackedPerson]:
        """Every person by id."""
        return self._tracker.known

    def sight(
        self,
        judged: JudgedFrame,
        observer: RobotState,
        world: World,
        at: Instant,
        new_id: str,
    ) -> list[Placed]:
        """Take in one judged detection frame of its observer.

        ``at`` is the frame's source moment on our clocks; ``new_id`` begins the
        decision ids of new persons.

        Returns:
            Every detection with a place; confident ones are assigned.
        """
        pose = observer.pose_at_stamp(judged.frame.origin.own_s)
        placed = self._place(judged, observer, pose)
        if judged.rule.possible_people:
            placed = self._suspect(placed, observer, judged.rule, at)
        if any(box.class_ == "robot" for box in placed):
            peers = _believed_peers(observer, world, at)
            placed = [_match_peer(box, peers) for box in placed]
        placed = [_doubt(box, pose, observer) for box in placed]
        return self._assign(placed, observer, at, new_id)

    def _place(
        self, judged: JudgedFrame, observer: RobotState, pose: Pose2D | None
    ) -> list[Placed]:
        """Place detections in each possible frame; note those without a place."""
        placed: list[Placed] = []
        unknown, self.unplaced, bounds = set[str](), 0, self._bounds
        detections = zip(judged.frame.detections, judged.verdicts, strict=True)
        for detection, verdict in detections:
            is_placed = True
            for framed in resolve_box(detection, observer.description):
                position = None if framed is None else framed.position(pose)
                if framed is None or position is None:
                    # A place in another frame is no proof: this may be the true frame.
                    is_placed = False
                    if framed is None and detection.frame_id is not None:
                        unknown.add(detection.frame_id)
                    continue
                is_inside = bounds is None or bounds.contains(
                    *position[:2], _BEYOND_WALL_M
                )
                placed.append(
                    Placed(
                        detection,
                        framed,
                        position,
                        verdict.kind,
                        verdict.class_,
                        is_known=verdict.is_known,
                        is_beyond=not is_inside,
                    )
                )
                is_placed = is_placed and _is_possible(placed[-1])
            if not is_placed:
                self.unplaced += _may_be_somebody(detection, verdict, judged.rule)
        self.unknown_frames = frozenset(unknown)
        return placed

    def _suspect(
        self,
        placed: list[Placed],
        observer: RobotState,
        rule: DetectionRule,
        at: Instant,
    ) -> list[Placed]:
        """Note all looks at everybody; a faint person whom they confirm is an alert."""
        suspects = sorted(filter(_is_suspect, placed), key=_confidence, reverse=True)
        # The surest come first, so a crowd costs the faintest their look.
        del suspects[MOST_SUSPECTS:]
        faint = [FaintPerson(*box.position[:2], _confidence(box)) for box in suspects]
        least = rule.threshold.for_class("person")
        known = self._suspicions.look(observer.robot_id, faint, at, least)
        by_box = {id(box): looks for box, looks in zip(suspects, known, strict=True)}
        return [_with_looks(box, by_box.get(id(box))) for box in placed]

    def _assign(
        self, placed: Sequence[Placed], observer: RobotState, at: Instant, new_id: str
    ) -> list[Placed]:
        """Hand confident detections that are no fleet member to the tracker."""
        assigned = list(placed)
        indices = [
            index
            for index, box in enumerate(assigned)
            if box.kind == "alert" and box.peer is None
        ]
        picture = [
            PlacedDetection(
                assigned[index].class_ or "person",
                _sighting(assigned[index], observer, at),
                f"{new_id}-{index}",
            )
            for index in indices
        ]
        tracks = self._tracker.track_picture(picture, at)
        self.turned_away = tracks.count(None)
        for index, track in zip(indices, tracks, strict=True):
            if track is not None:
                assigned[index] = assigned[index]._replace(person=self.known[track])
        return assigned

    def track_obstacle(
        self,
        report: SafetyReport,
        at: Instant,
        new_id: str,
    ) -> TrackedPerson | None:
        """Track a walking obstacle of a robot's laser, as of ``at``."""
        obstacle = report.obstacle
        if obstacle is None or not obstacle.moved:
            return None
        name, x, y = report.robot_id, obstacle.x, obstacle.y
        sighting = Sighting(name, x, y, _HEIGHT_M, at, LASER, EVEN, None, laser=True)
        picture = [PlacedDetection("person", sighting, f"{new_id}-0")]
        (track,) = self._tracker.track_picture(picture, at)
        return None if track is None else self.known[track]

    def zone_radii(
        self, person: TrackedPerson, rule: DetectionRule, now: Instant
    ) -> Iterable[tuple[Sighting, float]]:
        """Every zone that protects somebody, with its radius now (m); a thing has none.

        All readers of zones use this method, so that all leave out the same zones.
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


def _with_looks(placed: Placed, looks: Looks | None) -> Placed:
    """A detection with all looks at it; a faint one counts if these confirm it."""
    if looks is None:
        return placed
    possible = placed.kind == "faint" and looks.confirmed
    kind = "alert" if possible else placed.kind
    return placed._replace(kind=kind, looks=looks, possible=possible)


def _is_possible(placed: Placed) -> bool:
    """Whether a box has an extent, and for a person the size of a person at most."""
    box = placed.framed.box
    fits = placed.class_ != "person" or (
        box.longer_side <= LIMITS.person_widest_m
        and box.zmax - box.zmin <= LIMITS.person_highest_m
    )
    return fits and box.shorter_side >= _THINNEST_M


def _may_be_somebody(
    detection: Detection, verdict: RuleVerdict, rule: DetectionRule
) -> bool:
    """Whether a detection would slow robots if its place were known."""
    suspected = verdict.class_ == "person" and detection.probability >= FAINT_FROM
    return verdict.kind == "alert" or (rule.possible_people and suspected)


class _Peer(NamedTuple):
    """A fleet member: pose by odometry, and greatest distance of a box of it (m).

    Only a believed robot explains a box, and only within the error of its place: its
    own claim must not take away a zone that another robot's camera made.
    """

    robot_id: str
    pose: Pose2D
    reach_m: float


def _believed_peers(observer: RobotState, world: World, at: Instant) -> Sequence[_Peer]:
    """Believed fleet members that an observer may see."""
    peers: list[_Peer] = []
    for peer in world.robots.values():
        if peer is observer or peer.odometry is None or not peer.is_believed(at):
            continue
        if peer.recording != observer.recording:
            continue
        reach, age = LIMITS.uncertainty_m, peer.age_s(at)
        if peer.description.is_described:
            # With an unknown size, one sighting too many is safer than one too few.
            reach += peer.profile.length / 2
        # A moving peer may be off by a walk in the age of its pose.
        if age is not None and not peer.stands:
            reach += LIMITS.walking_m_s * age
        peers.append(_Peer(peer.robot_id, peer.odometry.pose, reach))
    return peers


def _match_peer(placed: Placed, peers: Iterable[_Peer]) -> Placed:
    """Recognise a sighted robot as the fleet member that is there by odometry."""
    if placed.class_ != "robot":
        return placed
    x, y, _ = placed.position
    near = [
        (residual, peer.robot_id)
        for peer in peers
        if (residual := peer.pose.distance_to(x, y)) <= peer.reach_m
    ]
    return placed._replace(peer=min(near)[1]) if near else placed


def _doubt(placed: Placed, pose: Pose2D | None, observer: RobotState) -> Placed:
    """Doubt a detection beyond the walls (docs/safety.md, "The rule")."""
    is_unsure = placed.is_beyond and placed.kind == "alert" and placed.peer is None
    if pose is None or not is_unsure:
        return placed
    return placed._replace(doubtful=(pose, observer.profile.camera_range))


def _sighting(placed: Placed, observer: RobotState, at: Instant) -> Sighting:
    """Sighting by a detection; if its place is doubtful, at its observer."""
    x, y, z = placed.position
    reach, half = 0.0, placed.framed.box.longer_side / 2
    if placed.doubtful is not None:
        pose, reach = placed.doubtful
        x, y = pose.x, pose.y
    detection = placed.detection
    return Sighting(
        observer.robot_id,
        x,
        y,
        z,
        at,
        detection.class_id,
        detection.probability,
        placed.looks,
        reach,
        recording=observer.recording,
        possible=placed.possible,
        beyond_m=max(0.0, half - LIMITS.person_radius_m),
    )


def _is_suspect(placed: Placed) -> bool:
    return placed.class_ == "person" and placed.detection.probability >= KEPT_FROM


def _confidence(placed: Placed) -> float:
    return placed.detection.probability
