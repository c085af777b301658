"""A robot's newest goal: who gave it, and what the robot itself said of it."""

from iveg.domain import goals
from iveg.models.base import Model, moment


class Goal(Model):
    """A goal, in ``map`` (m)."""

    goal_id: str
    robot_id: str
    kind: goals.GoalKind
    x: float
    y: float
    aisle: str | None
    by: str
    state: goals.GoalState
    why: str | None
    sent_at: str
    answered_at: str | None
    ended_at: str | None
    forgotten_at: str | None

    @classmethod
    def of(cls, one: goals.FollowedGoal) -> "Goal":
        """At its newest step."""
        return cls(
            goal_id=one.goal.goal_id,
            robot_id=one.robot_id,
            kind=one.goal.kind,
            x=one.goal.x,
            y=one.goal.y,
            aisle=one.aisle,
            by=one.by,
            state=one.state,
            why=one.why,
            sent_at=moment(one.sent) or "",
            answered_at=moment(one.answered),
            ended_at=moment(one.ended),
            forgotten_at=moment(one.forgotten),
        )
