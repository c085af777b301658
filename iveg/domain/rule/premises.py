"""Premises of the claim "clear": what of them is missing now, for each robot.

A factor of 1.0 says that nobody is near.  That claim rests on the robot's own pose, on
the detectors of everybody in reach, and on nobody in reach being in doubt
(docs/safety.md, "Clear").  The list of what is missing is built here and nowhere else;
an empty list is the only way to 1.0.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.world import World

Premise = Literal["pose", "doubt", "detector"]


@dataclass(frozen=True, slots=True)
class Missing:
    """One premise that does not hold.

    Attributes:
        robot_id: Whose pose, detector or word it is.
    """

    premise: Premise
    robot_id: str

    @property
    def reason(self) -> str:
        """Reason of a speed limit that rests on it (docs/interfaces/mqtt.md)."""
        return "doubt" if self.premise == "doubt" else "stale"


def missing_premises(world: World, now: Instant) -> Mapping[str, tuple[Missing, ...]]:
    """What is missing for each robot, the reason for its limit first."""
    robots = world.robots.values()
    # Of most nothing lacks, and this is asked of all at each judgement.
    gaps = [
        (observer, premise)
        for observer in robots
        if not _is_plainly_whole(observer, now)
        for premise in _gaps(observer, now)
    ]
    return {
        name: ()
        if not gaps and _is_pose_young(robot, now)
        else tuple(_missing_of(robot, gaps, now))
        for name, robot in world.robots.items()
    }


def _is_pose_young(robot: RobotState, now: Instant) -> bool:
    age = robot.age_s(now)
    return age is not None and age <= LIMITS.silence_s


def _missing_of(
    robot: RobotState, gaps: list[tuple[RobotState, Premise]], now: Instant
) -> Iterator[Missing]:
    if not _is_pose_young(robot, now):
        yield _missing("pose", robot.robot_id)
    ours = robot.possible_poses()
    for observer, premise in gaps:
        if _concerns(observer, robot, ours):
            yield _missing(premise, observer.robot_id)


@lru_cache(maxsize=1024)
def _missing(premise: Premise, robot_id: str) -> Missing:
    """The same value each time: of a fleet that is blind hundreds are compared."""
    return Missing(premise, robot_id)


def _is_plainly_whole(observer: RobotState, now: Instant) -> bool:
    """Whether a robot was never doubted, and its newest frame is young and whole."""
    detector, whole_at = observer.detector, observer.detector.whole_at
    if whole_at is None or detector.flawed_at or observer.doubts.were_raised:
        return False
    return now.mono - whole_at <= LIMITS.silence_s


def _gaps(observer: RobotState, now: Instant) -> Iterator[Premise]:
    """What one robot leaves open for everybody in its reach."""
    if observer.doubts.active(now):
        yield "doubt"
    detector = observer.detector
    is_required = observer.description.has_detector and not observer.is_replay
    if detector.is_missing(now) if is_required else detector.is_flawed(now):
        yield "detector"


def _concerns(
    observer: RobotState, robot: RobotState, ours: tuple[Pose2D, ...]
) -> bool:
    """Whether a robot is where the observer's camera would protect it.

    ``ours``: where that may be.

    A robot of unknown place may be anywhere.  What a recording lacks concerns
    recordings of its own frame.
    """
    if observer is robot:
        return True
    if observer.recording != robot.recording:
        return False
    reach = observer.profile.camera_range + LIMITS.ring_most_m
    theirs = observer.possible_poses()
    if not theirs or not ours:
        return True
    for one in theirs:
        for two in ours:
            if one.distance_to(two.x, two.y) <= reach:
                return True
    return False
