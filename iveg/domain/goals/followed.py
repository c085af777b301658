"""The life of one goal as a table: state × event → new state.

::

    SENT ──accepted──> DRIVING ──reached──> REACHED      SENT ──refused──> REFUSED
      └──expired──> UNCONFIRMED: nobody sends it again, and a late word still counts
    SENT, DRIVING, UNCONFIRMED ──cancel──> CANCELLING ──dropped──> CANCELLED
                                               └──expired──> UNCONFIRMED
    every open state ──held──> DELETED        every open state ──replaced──> REPLACED

A pair without a row changes nothing: what has ended stays ended.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from iveg.domain.goals.orders import Goal
from iveg.domain.observations import Instant
from iveg.domain.transports import TransportId

GoalState = Literal[
    "SENT",
    "DRIVING",
    "UNCONFIRMED",
    "CANCELLING",
    "REACHED",
    "REFUSED",
    "CANCELLED",
    "DELETED",
    "REPLACED",
]
GoalEvent = Literal[
    "accepted",
    "refused",
    "reached",
    "dropped",
    "expired",
    "cancel",
    "held",
    "replaced",
]
ANSWERED_WITHIN_S = 10.0
"""An order that the robot has not answered by then is not confirmed (s)."""

OPEN_STATES: tuple[GoalState, ...] = ("SENT", "DRIVING", "UNCONFIRMED", "CANCELLING")
_TABLE: Mapping[tuple[GoalState, GoalEvent], GoalState] = {
    ("SENT", "accepted"): "DRIVING",
    ("SENT", "refused"): "REFUSED",
    ("SENT", "expired"): "UNCONFIRMED",
    ("UNCONFIRMED", "accepted"): "DRIVING",
    ("UNCONFIRMED", "refused"): "REFUSED",
    ("CANCELLING", "refused"): "REFUSED",
    ("CANCELLING", "expired"): "UNCONFIRMED",
    **{(one, "reached"): "REACHED" for one in ("SENT", "DRIVING", "UNCONFIRMED")},
    **{(one, "cancel"): "CANCELLING" for one in ("SENT", "DRIVING", "UNCONFIRMED")},
    **{(one, "dropped"): "CANCELLED" for one in OPEN_STATES},
    **{(one, "held"): "DELETED" for one in OPEN_STATES},
    **{(one, "replaced"): "REPLACED" for one in OPEN_STATES},
}


@dataclass(frozen=True, slots=True)
class FollowedGoal:
    """One goal from a person's wish to its end.

    Attributes:
        by: Who gave it.
        sent: When; ``answered``: the robot's first word; ``ended``: its last change.
        asked: When the robot was last asked something: goal or cancellation.
        why: Code of the robot's refusal.
        forgotten: When the robot itself first said that it drives to it no longer.
        left: When each transport took it; ``words`` the robot's first word by each.
    """

    robot_id: str
    goal: Goal
    by: str
    sent: Instant
    asked: Instant
    aisle: str | None = None
    state: GoalState = "SENT"
    why: str | None = None
    answered: Instant | None = None
    ended: Instant | None = None
    forgotten: Instant | None = None
    left: Mapping[TransportId, Instant] = field(default_factory=dict)
    words: Mapping[TransportId, Instant] = field(default_factory=dict)

    @property
    def is_open(self) -> bool:
        """Whether the robot may be on its way."""
        return self.state in OPEN_STATES

    def after(
        self, event: GoalEvent, at: Instant, why: str | None = None
    ) -> "FollowedGoal":
        """The goal after an event; itself where that changes nothing."""
        state = _TABLE.get((self.state, event))
        if state is None:
            return self
        is_word = event in ("accepted", "refused", "reached", "dropped")
        return replace(
            self,
            state=state,
            why=why,
            asked=at if event == "cancel" else self.asked,
            answered=at if is_word and self.answered is None else self.answered,
            ended=None if state in OPEN_STATES else at,
        )

    def left_by(self, transport: TransportId, at: Instant) -> "FollowedGoal":
        """Note that a transport took it."""
        return replace(self, left={transport: at, **self.left})

    def heard_by(self, transport: TransportId, at: Instant) -> "FollowedGoal":
        """Note the robot's word by a transport; the first one counts."""
        return replace(self, words={transport: at, **self.words})

    def is_overdue(self, now: Instant) -> bool:
        """Whether what was asked last can be answered no more."""
        return now.mono - self.asked.mono > ANSWERED_WITHIN_S
