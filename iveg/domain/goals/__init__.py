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
from iveg.domain.goals.refusals import REASONS, refusal

__all__ = [
    "ANSWERED_WITHIN_S",
    "OPEN_STATES",
    "REASONS",
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
    "refusal",
]
