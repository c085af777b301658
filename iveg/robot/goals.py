"""Goals on the robot: the place that iVeg sent it to, until anything holds it.

::

    none ──set, while it runs──> driving ──near and at rest──> there
    driving, there ──a hold, cancelled, replaced──> none

A goal has no effect on the gate: it only tells navigation where to go,
and every hold makes the robot forget it.
"""

from collections.abc import Callable
from dataclasses import dataclass

from iveg.domain.geometry import Pose2D
from iveg.domain.goals import CancelOrder, Goal, GoalOrder
from iveg.domain.observations import GoalAnswer, Origin

Navigate = Callable[[Goal | None], bool]
"""Takes a goal, or None to give it up; returns whether it knows a way there."""

NEAR_M = 0.5
"""Distance from the place at which a robot at rest has reached it (m)."""
_REMEMBERED = 64
"""Answers that are kept for further copies of their orders."""


@dataclass(frozen=True, slots=True)
class Facts:
    """The robot's knowledge of itself at this moment.

    Attributes:
        runs: It may drive: no hold, and resumed.
        challenge: As reported; it changes with every hold and resume.
        own_s: Its monotonic clock (s).
        pose: In ``map``; None while it does not know.
        stands: Whether it is measured to stand.
    """

    runs: bool
    challenge: str
    own_s: float
    pose: Pose2D | None
    stands: bool


class RobotGoals:
    """The goal of one robot.

    Args:
        robot_id: This robot.
        navigate: Its navigation; None: it has none and refuses every goal.

    Attributes:
        goal: Place that it is to reach; None: it goes on with its own work.
    """

    def __init__(self, robot_id: str, navigate: Navigate | None = None) -> None:
        self._id, self._navigate = robot_id, navigate
        self.goal: Goal | None = None
        self._is_there = False
        self._judged: dict[str, GoalAnswer] = {}

    def answer(self, order: GoalOrder | CancelOrder, facts: Facts) -> list[GoalAnswer]:
        """Judge the first copy of an order; give every other the same answer."""
        if isinstance(order, CancelOrder):
            return self._cancel(order.goal_id)
        goal_id = order.goal_id
        if goal_id in self._judged:
            return [self._judged[goal_id]]
        reason = self._why_not(order, facts)
        answers = [] if reason else self._drop("replaced")
        if reason is None and not (self._navigate and self._navigate(order)):
            reason = "no_way"
        if reason is None:
            self.goal, self._is_there = order, False
        return [*answers, self._judge(goal_id, reason)]

    def settle(self, facts: Facts) -> list[GoalAnswer]:
        """Forget the goal of a robot that is held; note when it is reached."""
        goal = self.goal
        if goal is None:
            return []
        if not facts.runs:
            return self._drop("held")
        if self._is_there or facts.pose is None or not facts.stands:
            return []
        is_near = facts.pose.distance_to(goal.x, goal.y) <= NEAR_M
        if not is_near and goal.kind != "pause":
            return []
        self._is_there = True
        return [self._answer(goal.goal_id, "REACHED")]

    def _why_not(self, order: GoalOrder, facts: Facts) -> str | None:
        """Code of the reason against a goal; None when it may be driven to."""
        if not facts.runs:
            return "held"
        if order.challenge != facts.challenge:
            return "challenge"
        if facts.own_s > order.until_s:
            return "too_late"
        return "no_pose" if facts.pose is None else None

    def _cancel(self, goal_id: str) -> list[GoalAnswer]:
        # A copy of the goal may come after its cancellation, by another transport.
        if goal_id not in self._judged:
            self._judge(goal_id, "cancelled")
        if self.goal is not None and self.goal.goal_id == goal_id:
            return self._drop("cancelled")
        return [self._answer(goal_id, "DROPPED", "cancelled")]

    def _drop(self, why: str) -> list[GoalAnswer]:
        """Forget the goal; navigation learns of it before iVeg does."""
        goal, self.goal = self.goal, None
        if goal is None:
            return []
        if self._navigate is not None:
            self._navigate(None)
        return [self._answer(goal.goal_id, "DROPPED", why)]

    def _judge(self, goal_id: str, why: str | None) -> GoalAnswer:
        result = "ACCEPTED" if why is None else "REFUSED"
        self._judged[goal_id] = self._answer(goal_id, result, why)
        while len(self._judged) > _REMEMBERED:
            del self._judged[next(iter(self._judged))]
        return self._judged[goal_id]

    def _answer(self, goal_id: str, result: str, why: str | None = None) -> GoalAnswer:
        return GoalAnswer(self._id, Origin(), goal_id, result, why)
