"""Conditions of the claim "clear", and which of them each robot does not meet now.

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
        reason: A pose that is not young, a robot in doubt, a detector not read whole.
        robot_id: Whose pose, detector or word it is.
    """

    reason: Reason
    robot_id: str

    @property
    def limit_reason(self) -> str:
        """Reason of a speed limit that rests on it (docs/interfaces/mqtt.md)."""
        return "doubt" if self.reason == "doubt" else "stale"


def unmet_conditions(
    world: World, now: Instant
) -> Mapping[str, tuple[ClearCondition, ...]]:
    """Unmet conditions of each robot, the reason for its limit first."""
    robots = world.robots.values()
    unmet = [
        (observer, conditions)
        for observer in robots
        if (conditions := _conditions(observer, now))
    ]
    return {robot.robot_id: tuple(_unmet_by(robot, unmet, now)) for robot in robots}


def _unmet_by(
    robot: RobotState,
    unmet: Sequence[tuple[RobotState, Sequence[ClearCondition]]],
    now: Instant,
) -> Iterator[ClearCondition]:
    """Its own pose is young, and nobody in its reach leaves a condition unmet."""
    age = robot.age_s(now)
    if age is None or age > LIMITS.silence_s:
        yield ClearCondition("pose", robot.robot_id)
    for observer, conditions in unmet:
        if _is_in_reach(robot, observer):
            yield from conditions


def _is_in_reach(robot: RobotState, observer: RobotState) -> bool:
    """Whether a robot may be where the observer's camera would protect it.

    A robot of unknown place may be anywhere.  What a recording lacks concerns
    recordings of its own frame.
    """
    if observer is robot:
        return True
    if observer.recording != robot.recording:
        return False
    theirs, ours = observer.possible_poses(), robot.possible_poses()
    reach_m = observer.profile.camera_range + LIMITS.zone_most_m
    return (
        not theirs
        or not ours
        or any(
            one.distance_to(two.x, two.y) <= reach_m for one in theirs for two in ours
        )
    )


def _conditions(observer: RobotState, now: Instant) -> list[ClearCondition]:
    """Conditions that one robot leaves unmet for everybody in its reach."""
    return [
        ClearCondition(reason, observer.robot_id) for reason in _reasons(observer, now)
    ]


def _reasons(observer: RobotState, now: Instant) -> Iterator[Reason]:
    if observer.doubts.active(now):
        yield "doubt"
    detector = observer.detector
    is_required = observer.description.has_detector and not observer.is_replay
    if detector.is_missing(now) if is_required else detector.is_flawed(now):
        yield "detector"
