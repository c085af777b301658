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
    if all(_is_plainly_whole(one, now) for one in robots):
        return dict.fromkeys(world.robots, ())
    gaps = [
        _Gap.of(observer, premise)
        for observer in robots
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


@dataclass(frozen=True, slots=True)
class _Gap:
    """What one robot leaves open, and whom that concerns.

    Attributes:
        theirs: Where the observer may be; its camera protects so far (``reach_m``).
    """

    observer: RobotState
    missing: Missing
    recording: str | None
    theirs: tuple[Pose2D, ...]
    reach_m: float

    @classmethod
    def of(cls, observer: RobotState, premise: Premise) -> "_Gap":
        """What is the same for everybody whom it may concern."""
        return cls(
            observer,
            _missing(premise, observer.robot_id),
            observer.recording,
            observer.possible_poses(),
            observer.profile.camera_range + LIMITS.ring_most_m,
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


def _missing_of(robot: RobotState, gaps: list[_Gap], now: Instant) -> Iterator[Missing]:
    if not _is_pose_young(robot, now):
        yield _missing("pose", robot.robot_id)
    ours, recording = robot.possible_poses(), robot.recording
    for gap in gaps:
        if gap.concerns(robot, recording, ours):
            yield gap.missing


@lru_cache(maxsize=1024)
def _missing(premise: Premise, robot_id: str) -> Missing:
    """The same value each time: of a fleet that is blind hundreds are compared."""
    return Missing(premise, robot_id)


def _is_plainly_whole(robot: RobotState, now: Instant) -> bool:
    """Whether nothing of a robot lacks, plainly.

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


def _gaps(observer: RobotState, now: Instant) -> Iterator[Premise]:
    """What one robot leaves open for everybody in its reach."""
    if observer.doubts.active(now):
        yield "doubt"
    detector = observer.detector
    is_required = observer.description.has_detector and not observer.is_replay
    if detector.is_missing(now) if is_required else detector.is_flawed(now):
        yield "detector"
