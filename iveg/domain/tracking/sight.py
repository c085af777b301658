"""Lines of sight: what a frame of a camera shows, and how zones and trust end by it.

A zone goes by time, or because the camera that made it has had its centre in view for a
second and found nobody, not even faintly; never for one missing frame, and never by the
word of another (docs/safety.md, "Age").  A camera that misses somebody whom another one
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
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.words import meaning_of
from iveg.domain.world import World

CLEAR_S, CLEAR_FRAMES = 1.0, 5
SUSPECT_M = 1.0
"""A box so near to a place may be of the person who was there."""
_EDGE_RAD = math.radians(5.0)
"""Margin inside the picture within which a person is seen whole."""
_NEAR_M, _RANGE_SHARE = 1.0, 0.75
_FRESH_S = 0.5
"""A frame that took longer, or came so long after the one before, proves nothing."""

_Place = tuple[float, float]
_NONE = np.empty(0, np.intp)


@dataclass(frozen=True, slots=True)
class Look:
    """Content of one frame of a camera.

    Attributes:
        camera: Where it was made, in ``map``; None: it proves nothing to be empty.
        people: Where it shows a person, however faintly, in ``map`` (m).
        robots: The same of robots; ``unknown`` of what nobody has a word for.
        at: When it came.
    """

    robot: RobotState
    camera: Pose2D | None
    people: Sequence[_Place]
    robots: Sequence[_Place]
    unknown: Sequence[_Place]
    at: Instant

    @classmethod
    def of_frame(
        cls,
        robot: RobotState,
        frame: DetectionFrame,
        placed: Iterable[Placed],
        at: Instant,
    ) -> "Look":
        """A frame that was taken in, and what of it could be placed."""
        places = defaultdict[str, list[_Place]](list)
        for one in placed:
            if one.detection.probability >= KEPT_FROM:
                is_known = meaning_of(one.detection.class_id) is not None
                meant = one.class_ or ("known" if is_known else "unknown")
                places[meant].append(one.position[:2])
        origin = frame.origin
        pose, is_counted = robot.pose_at_stamp(origin.own_s), origin.seq is not None
        is_late = is_counted and not robot.is_newest(DetectionFrame, origin)
        camera = None if pose is None or is_late else _camera_at(pose, robot, at)
        people, robots, unknown = (
            places[one] for one in ("person", "robot", "unknown")
        )
        return cls(robot, camera, people, robots, unknown, at)

    def in_view(
        self, spots: Sequence[_Place], greenhouse: Greenhouse
    ) -> NDArray[np.intp]:
        """The spots at which a person would surely be in the picture."""
        if self.camera is None or not spots:
            return _NONE
        return _in_view(self.camera, self.robot.profile, spots, greenhouse)

    def shows_person_at(self, x: float, y: float, within_m: float = SUSPECT_M) -> bool:
        """Whether a box may be of a person at a spot."""
        return any(math.dist(one, (x, y)) <= within_m for one in self.people)

    def shows(self, person: TrackedPerson, x: float, y: float) -> bool:
        """Whether a box may be of this person or robot; an unknown word counts."""
        others = (*self.unknown, *(self.robots if person.class_ == "robot" else ()))
        near = any(math.dist(one, (x, y)) <= SUSPECT_M for one in others)
        return near or self.shows_person_at(x, y)


def visible_from(
    robot: RobotState, spots: ArrayLike, greenhouse: Greenhouse, now: Instant
) -> NDArray[np.intp]:
    """The spots that a robot's camera has in view now, with nothing in between.

    Args:
        robot: One whose camera may be blind: then none.
        spots: Shape (n, 2), in ``map`` (m).
        greenhouse: What stands in between.
        now: This moment.
    """
    camera = _camera_now(robot, now)
    if camera is None:
        return _NONE
    return _in_view(camera, robot.profile, spots, greenhouse)


def is_detecting(robot: RobotState, now: Instant) -> bool:
    """Whether a robot's camera works and its place is known."""
    return _camera_now(robot, now) is not None


def _camera_now(robot: RobotState, now: Instant) -> Pose2D | None:
    """Where a camera is that can be relied on."""
    if robot.odometry is None or robot.detector.blind_by is not None:
        return None
    return _camera_at(robot.odometry.pose, robot, now)


def _camera_at(pose: Pose2D, robot: RobotState, now: Instant) -> Pose2D | None:
    """Where a robot's camera is, if its frames are read and fresh and it is LIVE.

    Whoever contradicts itself, however shortly, finds no spot empty.
    """
    looked, detector = robot.detections_at, robot.detector
    if looked is None or not robot.is_believed(now):
        return None
    is_unread = detector.is_flawed(now, but="blind")
    is_late = now.mono - looked > _FRESH_S
    if is_unread or is_late or detector.out_of_service is not None:
        return None
    return pose.compose(robot.profile.camera)


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
    clear = [
        one
        for one in in_picture.tolist()
        if greenhouse.in_sight(camera.x, camera.y, x[one], y[one])
    ]
    return np.array(clear, np.intp)


@dataclass(frozen=True, slots=True)
class _Watch:
    """A zone that its own camera may find empty.

    Attributes:
        sighting: That made it.
        since: When the first of the frames in a row came that show nobody; ``newest``
            (monotonic, s).
        frames: How many they are.
    """

    sighting: Sighting
    since: float = 0.0
    newest: float = 0.0
    frames: int = 0

    def going_on(self, at: float) -> "_Watch":
        """The watch after one more frame that shows nobody."""
        is_first = self.frames == 0 or at - self.newest > _FRESH_S
        since, frames = (at, 1) if is_first else (self.since, self.frames + 1)
        return replace(self, since=since, newest=at, frames=frames)

    @property
    def is_over(self) -> bool:
        """Whether that is long enough to end the zone."""
        lasted_s = self.newest - self.since
        return self.frames >= CLEAR_FRAMES and lasted_s >= CLEAR_S - 1e-6


class OwnSight:
    """Takes zones away whose own camera sees their place to be empty."""

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self._watched: dict[str, Mapping[int, _Watch]] = {}
        """Watches by robot and chain."""

    def take(self, look: Look, people: People) -> list[TrackedPerson]:
        """Take a frame that ``people`` has taken in; returns whose zones it ended."""
        before = self._watched.get(look.robot.robot_id, {})
        watched: dict[int, _Watch] = {}
        ended: list[tuple[str, Sighting]] = []
        for person, sighting in _own_zones(people, look):
            watch = before.get(sighting.chain)
            if watch is None or watch.sighting.at != sighting.at:
                watch = _Watch(sighting)
            watch = self._looked(watch, person, look)
            watched[sighting.chain] = watch
            if watch.is_over:
                ended.append((person.person_id, sighting))
        self._watched[look.robot.robot_id] = watched
        return [people.drop_sighting(*one) for one in ended]

    def _looked(self, watch: _Watch, person: TrackedPerson, look: Look) -> _Watch:
        sighting = watch.sighting
        place = sighting.x, sighting.y
        is_empty = (
            sighting.age_s(look.at) > LIMITS.seen_s
            and look.robot.detector.blind_by is None
            and not look.shows(person, *place)
            and look.in_view([place], self._greenhouse).size == 1
        )
        if is_empty:
            return watch.going_on(look.at.mono)
        return replace(watch, frames=0) if watch.frames else watch


def _own_zones(people: People, look: Look) -> Iterator[tuple[TrackedPerson, Sighting]]:
    """Zones of known places that the camera of a look made; none of a recording."""
    robot = look.robot
    if robot.is_replay:
        return
    for person in people.known.values():
        for one in person.sightings:
            if (
                one.observer == robot.robot_id
                and one.recording is None
                and not (one.reach_m or one.laser)
            ):
                yield person, one


# --- blind cameras ----------------------------------------------------------------

BLIND_S = 5.0
APART_S = 0.15
"""Between two frames of one camera that are compared with what others see."""
_HIDES_M = 0.5
"""Half of a person who stands between, and the error of a place."""


class _Spell(NamedTuple):
    """From the first to the newest frame without them (monotonic, s)."""

    began: float
    newest: float


class BlindCameras:
    """Finds cameras that report nothing where another one surely sees somebody.

    A covered lens sends empty frames, which look like an empty aisle.  A person who
    stands for five seconds in the view of two cameras and is seen by one of them alone
    tells them apart.  From then on no frame of the other is whole (docs/safety.md,
    "Clear"), until it shows somebody again.
    """

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self._missing: dict[str, dict[int, _Spell]] = {}
        """Spells by robot, and chain of the other one."""
        self._looked_at: dict[str, float] = {}
        """Moment of each robot's newest frame that was taken (monotonic, s)."""

    def take(self, look: Look, people: People, world: World) -> None:
        """Take a frame that ``people`` has taken in.

        A frame that proves nothing (late, or somebody walks between) ends no spell:
        more than a second without a frame that does is silence, which slows anyway.
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
            chain: one
            for chain, one in before.items()
            if now - one.newest <= LIMITS.silence_s + 1e-6
        }
        for one, is_shown in self._sought(look, people, world):
            if is_shown:
                spells.pop(one.chain, None)
                continue
            began = spells.get(one.chain, _Spell(now, now)).began
            spells[one.chain] = _Spell(began, now)
            if now - began >= BLIND_S - 1e-6:
                detector.blind_by = one.observer
        if detector.out_of_service is not None or (look.people and not spells):
            detector.blind_by = None

    def _sought(
        self, look: Look, people: People, world: World
    ) -> Iterator[tuple[Sighting, bool]]:
        """People in view whom another camera surely sees, and whether this one does."""
        camera, reach_m = look.camera, look.robot.profile.camera_range
        seen = [
            one
            for person in people.known.values()
            if person.class_ == "person"
            for one in person.sightings
            if one.age_s(look.at) <= LIMITS.seen_s
            and one.recording is None
            and (camera is None or camera.distance_to(one.x, one.y) <= reach_m)
        ]
        sure = [one for one in seen if _is_sure(one, look, world)]
        in_view = look.in_view([(one.x, one.y) for one in sure], self._greenhouse)
        for index, one in enumerate(sure):
            near_m = SUSPECT_M + LIMITS.walking_m_s * one.age_s(look.at)
            if look.shows_person_at(one.x, one.y, near_m):
                yield one, True
            elif camera is not None and index in in_view:
                beside = ((two.x, two.y, _HIDES_M) for two in seen)
                if not self._is_hidden(one, camera, [*beside, *_peers(look, world)]):
                    yield one, False

    def _is_hidden(
        self, one: Sighting, camera: Pose2D, bodies: list[tuple[float, float, float]]
    ) -> bool:
        """Whether crates, somebody or a peer stands between a camera and somebody."""
        here, there = (camera.x, camera.y), (one.x, one.y)
        return any(
            each.area.crosses(*here, *there) for each in self._greenhouse.obstacles
        ) or any(
            math.dist((x, y), there) > _HIDES_M and _off((x, y), here, there) <= radius
            for x, y, radius in bodies
        )


def _is_sure(one: Sighting, look: Look, world: World) -> bool:
    """Whether a sighting is another camera's, by a box, of a robot beyond doubt."""
    if one.observer == look.robot.robot_id or one.possible or one.laser or one.reach_m:
        return False
    observer = world.robot(one.observer)
    return observer.is_believed(look.at) and not observer.detector.is_flawed(look.at)


def _peers(look: Look, world: World) -> Iterator[tuple[float, float, float]]:
    """Bodies of peers: x, y and half of their length, and the error of a place (m)."""
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
