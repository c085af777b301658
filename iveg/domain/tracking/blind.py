"""Cameras that report nothing where another camera surely sees somebody.

A covered lens sends empty frames, which look like an empty aisle.  Whoever stands for
five seconds in the view of two cameras and is seen by one of them alone tells them
apart.  From then on no frame of the other is whole (docs/safety.md, "Clear"), until it
shows somebody again.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from iveg.domain.geometry import Pose2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Sighting
from iveg.domain.tracking.sight import SUSPECT_M, Look
from iveg.domain.world import World

BLIND_S = 5.0
_BODY_M = 0.5
"""Half of a person, and the error of a place."""

_Place = tuple[float, float]


class _Spell(NamedTuple):
    """From the first to the newest frame without them (monotonic, s)."""

    began: float
    newest: float


class BlindCameras:
    """Finds them, by each frame of theirs, and notes who sees what they do not."""

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self._missing: dict[str, dict[int, _Spell]] = {}
        """By robot and chain of the other one."""

    def take(self, look: Look, people: People, world: World) -> None:
        """Take a frame that ``people`` has taken in.

        A frame that proves nothing (late, or somebody walks between) ends no spell:
        more than a second without a frame that does is silence, which slows anyway.
        """
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
        if detector.blind_by is not None:
            detector.note_flaw("blind", look.at)

    def _sought(
        self, look: Look, people: People, world: World
    ) -> Iterator[tuple[Sighting, bool]]:
        """Whom another camera surely sees in view of this one; whether it does, too."""
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
                beside = ((two.x, two.y, _BODY_M) for two in seen)
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
            math.dist((x, y), there) > _BODY_M and _off((x, y), here, there) <= radius
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
    """How far a place is from the line between two others (m)."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    along = (place[0] - start[0]) * dx + (place[1] - start[1]) * dy
    share = min(1.0, max(0.0, along / max(dx * dx + dy * dy, 1e-9)))
    return math.dist(place, (start[0] + share * dx, start[1] + share * dy))
