"""Conditions of the claim "clear", and which of them each robot does not meet now.

A factor of 1.0 says that nobody is near.  That claim rests on the robot's own pose, on
the detectors of everybody in reach, and on nobody in reach being in doubt
(docs/safety.md, "Clear").  The list of unmet conditions is built here and nowhere
else; an empty list is the only way to 1.0.
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
    if all(_is_plainly_whole(one, now) for one in robots):
        return dict.fromkeys(world.robots, ())
    unmet = [
        _Unmet.at(observer, reason)
        for observer in robots
        for reason in _reasons(observer, now)
    ]
    return {
        name: ()
        if not unmet and _is_pose_young(robot, now)
        else tuple(_unmet_by(robot, unmet, now))
        for name, robot in world.robots.items()
    }


def _is_pose_young(robot: RobotState, now: Instant) -> bool:
    age = robot.age_s(now)
    return age is not None and age <= LIMITS.silence_s


@dataclass(frozen=True, slots=True)
class _Unmet:
    """A condition that one robot leaves unmet, and whom that concerns.

    Attributes:
        theirs: Where the observer may be; its camera protects so far (``reach_m``).
    """

    observer: RobotState
    condition: ClearCondition
    recording: str | None
    theirs: tuple[Pose2D, ...]
    reach_m: float

    @classmethod
    def at(cls, observer: RobotState, reason: Reason) -> "_Unmet":
        """What is the same for everybody whom it may concern."""
        return cls(
            observer,
            _condition(reason, observer.robot_id),
            observer.recording,
            observer.possible_poses(),
            observer.profile.camera_range + LIMITS.zone_most_m,
        )

    def concerns(
        self, robot: RobotState, recording: str | None, ours: tuple[Pose2D, ...]
    ) -> bool:
        """Whether a robot is where the observer's camera would protect it.

        ``ours``: where that may be.

        A robot of unknown place may be anywhere.  What a recording lacks concerns
        recordings of its own frame.
        """
        if self.observer is robot:
            return True
        if self.recording != recording:
            return False
        if not self.theirs or not ours:
            return True
        for one in self.theirs:
            for two in ours:
                if one.distance_to(two.x, two.y) <= self.reach_m:
                    return True
        return False


def _unmet_by(
    robot: RobotState, unmet: list[_Unmet], now: Instant
) -> Iterator[ClearCondition]:
    if not _is_pose_young(robot, now):
        yield _condition("pose", robot.robot_id)
    ours, recording = robot.possible_poses(), robot.recording
    for one in unmet:
        if one.concerns(robot, recording, ours):
            yield one.condition


@lru_cache(maxsize=1024)
def _condition(reason: Reason, robot_id: str) -> ClearCondition:
    """One value for each: of a fleet that is blind hundreds are compared."""
    return ClearCondition(reason, robot_id)


def _is_plainly_whole(robot: RobotState, now: Instant) -> bool:
    """Whether a robot plainly leaves no condition unmet.

    It was never doubted, and its pose and its newest frame are young, and that whole.
    """
    detector, pose_at = robot.detector, robot.pose_at
    whole_at = detector.whole_at
    if whole_at is None or pose_at is None:
        return False
    if detector.flawed_at or robot.doubts.were_raised:
        return False
    # Asked of all at each judgement.
    return now.mono - min(whole_at, pose_at) <= LIMITS.silence_s


def _reasons(observer: RobotState, now: Instant) -> Iterator[Reason]:
    """Conditions that one robot leaves unmet for everybody in its reach."""
    if observer.doubts.active(now):
        yield "doubt"
    detector = observer.detector
    is_required = observer.description.has_detector and not observer.is_replay
    if detector.is_missing(now) if is_required else detector.is_flawed(now):
        yield "detector"
