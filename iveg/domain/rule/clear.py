"""Conditions of the claim "clear", and those that each robot does not meet now.

A factor of 1.0 says that nobody is near.  That claim rests on the robot's own pose, on
the detectors of everybody in reach, and on nobody in reach being in doubt
(docs/safety.md, "Clear").  The list of unmet conditions is built here and nowhere
else; an empty list is the only way to 1.0.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, compress
from typing import Literal

import numpy as np
from numpy.typing import NDArray

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
    robots = [*world.robots.values()]
    unmet = [[*_conditions(observer, now)] for observer in robots]
    return {
        robot.robot_id: (
            *_conditions_of_pose(robot, now),
            *chain.from_iterable(compress(unmet, is_near.tolist())),
        )
        for robot, is_near in zip(robots, _in_reach(robots), strict=True)
    }


def _conditions_of_pose(robot: RobotState, now: Instant) -> Iterator[ClearCondition]:
    """Condition that a robot's own pose leaves unmet, for itself alone."""
    age = robot.age_s(now)
    if age is None or age > LIMITS.silence_s:
        yield ClearCondition("pose", robot.robot_id)


def _in_reach(robots: Sequence[RobotState]) -> NDArray[np.bool_]:
    """Whether each robot (row) may be where each observer's camera would protect it.

    A robot without a known place may be anywhere.  A recording's conditions concern
    recordings of the same map alone.
    """
    places = [robot.possible_places() for robot in robots]
    x, y = np.array(places).reshape(-1, 2, 2).T[:, :, :, None, None]
    # The zone of a person at the end of the camera's range reaches farther by this.
    reach_m = [[robot.profile.camera_range + LIMITS.zone_most_m] for robot in robots]
    # To a place that is no number no distance is greater: it may be near.
    is_far = np.hypot(x - x.T, y - y.T) > np.array(reach_m)
    maps = np.array([robot.recording for robot in robots], object)
    return np.array(~is_far.all(axis=(0, 3)) & (maps[:, None] == maps), np.bool_)


def _conditions(observer: RobotState, now: Instant) -> Iterator[ClearCondition]:
    """Conditions that one robot leaves unmet for everybody in its reach."""
    if observer.doubts.active(now):
        yield ClearCondition("doubt", observer.robot_id)
    detector = observer.detector
    is_required = observer.description.has_detector and not observer.is_replay
    # Where no detector is required a refused frame still counts: it may show somebody.
    if detector.is_missing(now) if is_required else detector.is_flawed(now):
        yield ClearCondition("detector", observer.robot_id)
