"""What a robot is told of a goal (docs/interfaces/commands.md)."""

from dataclasses import dataclass
from typing import Literal

GoalKind = Literal["here", "aisle", "return", "pause"]


@dataclass(frozen=True, slots=True)
class Goal:
    """A place to drive to and to stay at; ``pause``: the place where the robot is.

    Attributes:
        x: In ``map`` (m); ``y`` too.
    """

    goal_id: str
    kind: GoalKind
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class GoalOrder:
    """A goal, and until when it may be taken.

    Attributes:
        challenge: Of the robot's newest report: every hold and resume makes another,
            so that no copy outlives a STOP.
        until_s: The last moment of the robot's own monotonic clock (s).
    """

    goal: Goal
    challenge: str
    until_s: float


@dataclass(frozen=True, slots=True)
class CancelOrder:
    """Forget this goal, and stay where you are."""

    goal_id: str
