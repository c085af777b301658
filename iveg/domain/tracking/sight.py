"""Lines of sight: the content of a camera frame, and how zones and trust end by it.

A zone goes by time, or because the camera that made it has had its centre in view for a
second and found nobody, not even faintly.  Neither a missing frame nor another robot
ends it (docs/safety.md, "Age").  A camera that misses somebody whom another camera
surely sees is blind.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.looks import KEPT_FROM
from iveg.domain.tracking.people import People, Placed
from iveg.domain.tracking.tracker import Sighting, TrackedPerson
from iveg.domain.world import World

CLEAR_S, CLEAR_FRAMES = 1.0, 5
SUSPECT_M = 1.0
"""A box this near to a place may be of the person who was there (m)."""
_EDGE_RAD = math.radians(5.0)
"""Margin inside the picture within which a person is whole."""
_NEAR_M, _RANGE_SHARE = 1.0, 0.75
_TOGETHER_S = 0.5
"""Longest gap between two frames in a row (s)."""

_Place = tuple[float, float]
_NONE = np.empty(0, np.intp)


@dataclass(frozen=True, slots=True)
class Look:
    """Content of one frame of a camera.

    Attributes:
        camera: Pose of the camera in ``map``; None: the frame proves no place empty.
        people: Places of persons, however faint, in ``map`` (m).
        robots: Places of robots; ``unknown`` of objects with an unknown word.
        at: Moment of its receipt.
    """

    robot: RobotState
    camera: Pose2D | None
    people: Sequence[_Place]
    robots: Sequence[_Place]
    unknown: Sequence[_Place]
    at: Instant

    @classmethod
    def from_frame(
        cls,
        robot: RobotState,
        frame: DetectionFrame,
        placed: Iterable[Placed],
        at: Instant,
    ) -> "Look":
        """Look by a frame that was taken in, and the detections that have a place."""
        places = defaultdict[str, list[_Place]](list)
        for box in placed:
            if box.detection.probability >= KEPT_FROM:
                meaning = box.class_ or ("known" if box.is_known else "unknown")
                places[meaning].append(box.position[:2])
        origin = frame.origin
        pose, is_counted = robot.pose_at_stamp(origin.own_s), origin.seq is not None
        is_late = is_counted and not robot.is_newest(DetectionFrame, origin)
        # A late frame says nothing of what is there now.
        camera = None if pose is None or is_late else robot.camera_at(pose, at)
        people, robots, unknown = (
            places[meaning] for meaning in ("person", "robot", "unknown")
        )
        return cls(robot, camera, people, robots, unknown, at)

    def in_view(
        self, spots: Sequence[_Place], greenhouse: Greenhouse
    ) -> NDArray[np.intp]:
        """Indices of the spots at which a person would surely be in the picture."""
        if self.camera is None or not spots:
            return _NONE
        return _in_view(self.camera, self.robot.profile, spots, greenhouse)

    def shows_person_at(self, x: float, y: float, within_m: float = SUSPECT_M) -> bool:
        """Whether a box may be of a person at a spot."""
        return any(math.dist(place, (x, y)) <= within_m for place in self.people)

    def shows(self, person: TrackedPerson, x: float, y: float) -> bool:
        """Whether a box may be of this person or robot; an unknown word counts."""
        places = (*self.unknown, *(self.robots if person.class_ == "robot" else ()))
        near = any(math.dist(place, (x, y)) <= SUSPECT_M for place in places)
        return near or self.shows_person_at(x, y)


def visible_from(
    robot: RobotState, spots: ArrayLike, greenhouse: Greenhouse, now: Instant
) -> NDArray[np.intp]:
    """Indices of the spots that a robot's camera has in view, with nothing in between.

    Args:
        robot: The robot; a blind camera has none in view.
        spots: Shape (n, 2), in ``map`` (m).
        greenhouse: What stands in between.
        now: This moment.
    """
    camera = robot.camera_now(now)
    if camera is None:
        return _NONE
    return _in_view(camera, robot.profile, spots, greenhouse)


def is_detecting(robot: RobotState, now: Instant) -> bool:
    """Whether a robot's camera works and its place is known."""
    return robot.camera_now(now) is not None


def _in_view(
    camera: Pose2D, profile: RobotProfile, spots: ArrayLike, greenhouse: Greenhouse
) -> NDArray[np.intp]:
    x, y = np.asarray(spots, np.float64).reshape(-1, 2).T
    distance = np.hypot(x - camera.x, y - camera.y)
    bearing = np.arctan2(y - camera.y, x - camera.x) - camera.yaw
    off = np.abs((bearing + math.pi) % math.tau - math.pi)
    in_picture = np.flatnonzero(
        (distance >= _NEAR_M)
        & (distance <= _RANGE_SHARE * profile.camera_range)
        & (off <= profile.camera_fov / 2 - _EDGE_RAD)
    )
    # A row of crop hides a person whose place is in the picture.
    clear = [
        index
        for index in in_picture.tolist()
        if greenhouse.in_sight(camera.x, camera.y, x[index], y[index])
    ]
    return np.array(clear, np.intp)


@dataclass(frozen=True, slots=True)
class _Watch:
    """A zone that its own camera may find empty.

    Attributes:
        sighting: The sighting that made it.
        since: Receipt of the first of the frames in a row that show nobody (monotonic,
            s); ``newest``: of the last.
        frames: Number of these frames.
    """

    sighting: Sighting
    since: float = 0.0
    newest: float = 0.0
    frames: int = 0

    def after_empty_frame(self, at: float) -> "_Watch":
        """The watch after one more frame that shows nobody."""
        is_first = self.frames == 0 or at - self.newest > _TOGETHER_S
        since, frames = (at, 1) if is_first else (self.since, self.frames + 1)
        return replace(self, since=since, newest=at, frames=frames)

    @property
    def is_over(self) -> bool:
        """Whether these frames are enough to end the zone."""
        lasted_s = self.newest - self.since
        return self.frames >= CLEAR_FRAMES and lasted_s >= CLEAR_S - 1e-6


class OwnSight:
    """Ends zones whose own camera sees that their place is empty."""

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self._watched: dict[str, Mapping[int, _Watch]] = {}
        """Watches by robot and chain."""

    def take(self, look: Look, people: People) -> list[TrackedPerson]:
        """Take a frame after ``people``; returns the persons that lost a zone by it."""
        before = self._watched.get(look.robot.robot_id, {})
        watched: dict[int, _Watch] = {}
        zones = list(_own_zones(people, look))
        empty = self._empty_chains(zones, look)
        for _, sighting in zones:
            watch = before.get(sighting.chain)
            # A newer sighting of the chain begins a new watch.
            if watch is None or watch.sighting.at != sighting.at:
                watch = _Watch(sighting)
            if sighting.chain in empty:
                watch = watch.after_empty_frame(look.at.mono)
            elif watch.frames:
                watch = replace(watch, frames=0)
            watched[sighting.chain] = watch
        self._watched[look.robot.robot_id] = watched
        return [
            people.drop_sighting(person.person_id, sighting)
            for person, sighting in zones
            if watched[sighting.chain].is_over
        ]

    def _empty_chains(
        self, zones: Iterable[tuple[TrackedPerson, Sighting]], look: Look
    ) -> set[int]:
        """Chains of the zones whose place a look shows to be empty."""
        if look.robot.detector.blind_by is not None:
            return set()
        # A person in sight is not missed yet: the second begins after that.
        missed = [
            sighting
            for person, sighting in zones
            if sighting.age_s(look.at) > LIMITS.seen_s
            and not look.shows(person, sighting.x, sighting.y)
        ]
        places = [(sighting.x, sighting.y) for sighting in missed]
        in_view = look.in_view(places, self._greenhouse)
        return {missed[index].chain for index in in_view}


def _own_zones(people: People, look: Look) -> Iterator[tuple[TrackedPerson, Sighting]]:
    """Zones at known places by the camera of this look; a recording has none."""
    robot = look.robot
    if robot.is_replay:
        return
    for person in people.known.values():
        for sighting in person.sightings:
            if (
                sighting.observer == robot.robot_id
                and sighting.recording is None
                and not (sighting.reach_m or sighting.laser)
            ):
                yield person, sighting


# --- blind cameras ----------------------------------------------------------------

BLIND_S = 5.0
APART_S = 0.15
"""Least time between two frames of a camera that are compared (s)."""
_HIDES_M = 0.5
"""Half the width of a person in between, with the error of a place (m)."""


class _Spell(NamedTuple):
    """Time in which a camera misses a person: first and newest frame (monotonic, s)."""

    began: float
    newest: float


class BlindCameras:
    """Finds cameras that report nobody where another camera surely sees somebody.

    A covered lens sends empty frames, which look like an empty aisle.  The proof is a
    person who stands in the view of two cameras for five seconds while only one camera
    sees them.  From then on no frame of the other camera is whole, until it shows
    somebody again (docs/safety.md, "Clear").
    """

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self._missing: dict[str, dict[int, _Spell]] = {}
        """Spells by robot, and by the chain of the other camera's sightings."""
        self._looked_at: dict[str, float] = {}
        """Receipt of each robot's newest compared frame (monotonic, s)."""

    def take(self, look: Look, people: People, world: World) -> None:
        """Take a frame after ``people``.

        A frame that proves nothing (late, or somebody walks in between) ends no spell.
        More than a second without a frame that proves something is silence, which slows
        robots anyway.
        """
        robot, now = look.robot, look.at.mono
        if now - self._looked_at.get(robot.robot_id, -math.inf) >= APART_S:
            self._looked_at[robot.robot_id] = now
            self._compare(look, people, world)
        if robot.detector.blind_by is not None:
            robot.detector.note_flaw("blind", look.at)

    def _compare(self, look: Look, people: People, world: World) -> None:
        robot, now = look.robot, look.at.mono
        detector, before = robot.detector, self._missing.get(robot.robot_id, {})
        spells = self._missing[robot.robot_id] = {
            chain: spell
            for chain, spell in before.items()
            if now - spell.newest <= LIMITS.silence_s + 1e-6
        }
        for sighting, is_shown in self._sought(look, people, world):
            if is_shown:
                spells.pop(sighting.chain, None)
                continue
            began = spells.get(sighting.chain, _Spell(now, now)).began
            spells[sighting.chain] = _Spell(began, now)
            if now - began >= BLIND_S - 1e-6:
                detector.blind_by = sighting.observer
        # A camera that shows somebody and misses nobody is not blind.
        if detector.out_of_service is not None or (look.people and not spells):
            detector.blind_by = None

    def _sought(
        self, look: Look, people: People, world: World
    ) -> Iterator[tuple[Sighting, bool]]:
        """Sure sightings by other cameras, and whether this look shows them, too."""
        camera, reach_m = look.camera, look.robot.profile.camera_range
        nearby = [
            sighting
            for person in people.known.values()
            if person.class_ == "person"
            for sighting in person.sightings
            if sighting.age_s(look.at) <= LIMITS.seen_s
            and sighting.recording is None
            and (
                camera is None or camera.distance_to(sighting.x, sighting.y) <= reach_m
            )
        ]
        sure = [sighting for sighting in nearby if _is_sure(sighting, look, world)]
        in_view = look.in_view(
            [(sighting.x, sighting.y) for sighting in sure], self._greenhouse
        )
        for index, sighting in enumerate(sure):
            # The person may have walked since the other camera's sighting.
            near_m = SUSPECT_M + LIMITS.walking_m_s * sighting.age_s(look.at)
            if look.shows_person_at(sighting.x, sighting.y, near_m):
                yield sighting, True
            elif camera is not None and index in in_view:
                beside = ((other.x, other.y, _HIDES_M) for other in nearby)
                if not self._is_hidden(
                    sighting, camera, [*beside, *_peers(look, world)]
                ):
                    yield sighting, False

    def _is_hidden(
        self,
        sighting: Sighting,
        camera: Pose2D,
        bodies: list[tuple[float, float, float]],
    ) -> bool:
        """Whether a crate, person or peer stands between a camera and a sighting."""
        here, there = (camera.x, camera.y), (sighting.x, sighting.y)
        return any(
            crate.area.crosses(*here, *there) for crate in self._greenhouse.obstacles
        ) or any(
            math.dist((x, y), there) > _HIDES_M and _off((x, y), here, there) <= radius
            for x, y, radius in bodies
        )


def _is_sure(sighting: Sighting, look: Look, world: World) -> bool:
    """Whether a sighting is by a box of another, trusted robot's camera."""
    is_own = sighting.observer == look.robot.robot_id
    if is_own or sighting.possible or sighting.laser or sighting.reach_m:
        return False
    observer = world.robot(sighting.observer)
    return observer.is_believed(look.at) and not observer.detector.is_flawed(look.at)


def _peers(look: Look, world: World) -> Iterator[tuple[float, float, float]]:
    """Bodies of peers: x, y, and radius with the error of a place (m)."""
    for robot in world.live_robots():
        is_peer = robot is not look.robot and robot.is_believed(look.at)
        if is_peer and robot.odometry is not None:
            pose, profile = robot.odometry.pose, robot.profile
            half = math.hypot(profile.length, profile.width) / 2
            yield pose.x, pose.y, half + LIMITS.uncertainty_m


def _off(place: _Place, start: _Place, end: _Place) -> float:
    """Distance of a place from the line between two others (m)."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    along = (place[0] - start[0]) * dx + (place[1] - start[1]) * dy
    share = min(1.0, max(0.0, along / max(dx * dx + dy * dy, 1e-9)))
    return math.dist(place, (start[0] + share * dx, start[1] + share * dy))
