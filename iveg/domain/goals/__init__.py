"""Goals that people give to robots, below STOP in every respect (docs/safety.md)."""

from iveg.domain.goals.followed import (
    ANSWERED_WITHIN_S,
    OPEN_STATES,
    FollowedGoal,
    GoalEvent,
    GoalState,
)
from iveg.domain.goals.orders import CancelOrder, Goal, GoalKind, GoalOrder
from iveg.domain.goals.permission import permit
from iveg.domain.goals.places import GoalWish, place_of

__all__ = [
    "ANSWERED_WITHIN_S",
    "OPEN_STATES",
    "CancelOrder",
    "FollowedGoal",
    "Goal",
    "GoalEvent",
    "GoalKind",
    "GoalOrder",
    "GoalState",
    "GoalWish",
    "permit",
    "place_of",
]
