"""Conditions of the claim "clear", and those that each robot does not meet now.

A factor of 1.0 says that nobody is near.  That claim rests on the robot's own pose, on
the detectors of everybody in reach, and on nobody in reach being in doubt
(docs/safety.md, "Clear").  The list of unmet conditions is built here and nowhere
else; an empty list is the only way to 1.0.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.world import World

Reason = Literal["pose", "doubt", "detector"]


@dataclass(frozen=True, slots=True)
class ClearCondition:
    """One condition that does not hold.

    Attributes:
        reason: ``pose``: the robot's own pose is too old; ``doubt``: a robot is in
            doubt; ``detector``: nothing proves that a detector works.
        robot_id: The robot that leaves the condition unmet.
    """

    reason: Reason
    robot_id: str

    @property
    def limit_reason(self) -> str:
        """Reason of the speed limit that it causes (docs/interfaces/mqtt.md)."""
        return "doubt" if self.reason == "doubt" else "stale"


def unmet_conditions(
    world: World, now: Instant
) -> Mapping[str, tuple[ClearCondition, ...]]:
    """Unmet conditions of each robot, the reason for its limit first."""
    robots = world.robots.values()
    unmet = [
        (observer, conditions)
        for observer in robots
        if (conditions := [*_conditions(observer, now)])
    ]
    return {robot.robot_id: tuple(_unmet_by(robot, unmet, now)) for robot in robots}


def _unmet_by(
    robot: RobotState,
    unmet: Sequence[tuple[RobotState, Sequence[ClearCondition]]],
    now: Instant,
) -> Iterator[ClearCondition]:
    """Unmet conditions of a robot: of its own pose, then of every robot in reach."""
    age = robot.age_s(now)
    if age is None or age > LIMITS.silence_s:
        yield ClearCondition("pose", robot.robot_id)
    for observer, conditions in unmet:
        if _is_in_reach(robot, observer):
            yield from conditions


def _is_in_reach(robot: RobotState, observer: RobotState) -> bool:
    """Whether a robot may be where the observer's camera would protect it.

    A robot without a known place may be anywhere.  A recording's conditions concern
    recordings of the same map alone.
    """
    if observer is robot:
        return True
    if observer.recording != robot.recording:
        return False
    observer_poses, robot_poses = observer.possible_poses(), robot.possible_poses()
    # The zone of a person at the end of the camera's range reaches farther by this.
    reach_m = observer.profile.camera_range + LIMITS.zone_most_m
    return (
        not observer_poses
        or not robot_poses
        or any(
            pose.distance_to(own.x, own.y) <= reach_m
            for pose in observer_poses
            for own in robot_poses
        )
    )


def _conditions(observer: RobotState, now: Instant) -> Iterator[ClearCondition]:
    """Conditions that one robot leaves unmet for everybody in its reach."""
    if observer.doubts.active(now):
        yield ClearCondition("doubt", observer.robot_id)
    detector = observer.detector
    is_required = observer.description.has_detector and not observer.is_replay
    # Where no detector is required a refused frame still counts: it may show somebody.
    if detector.is_missing(now) if is_required else detector.is_flawed(now):
        yield ClearCondition("detector", observer.robot_id)
