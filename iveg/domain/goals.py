"""Goals that people give to robots; STOP goes before them in all (docs/safety.md).

A goal lies in the greenhouse, and in no plant, post or crate.  ``REASONS`` has the
codes of refused goals (docs/interfaces/commands.md).  The states of a goal follow a
table: state × event → new state. ::

    SENT ──accepted──> DRIVING ──reached──> REACHED      SENT ──refused──> REFUSED
      └──expired──> UNCONFIRMED: never sent again; a late answer still counts
    SENT, DRIVING, UNCONFIRMED ──cancel──> CANCELLING ──dropped──> CANCELLED
                                               └──expired──> UNCONFIRMED
    every open state ──held──> DELETED        every open state ──replaced──> REPLACED

A pair without a row changes nothing: an ended goal stays ended.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Annotated, Literal

from pydantic import Field, Strict, with_config

from iveg.domain.errors import CommandRefusedError
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.robot_state import RobotState
from iveg.domain.wire import Metres, Text

GoalKind = Literal["here", "aisle", "return", "pause"]
GoalId = Annotated[Text, Field(min_length=1, alias="id")]


@dataclass(frozen=True, slots=True)
class Goal:
    """A place to drive to and to stay at; ``pause``: the robot's own place.

    Attributes:
        x: Position in ``map`` (m); ``y`` likewise.
    """

    goal_id: GoalId
    kind: GoalKind
    x: Metres
    y: Metres


@with_config(extra="forbid")
@dataclass(frozen=True, slots=True)
class GoalOrder(Goal):
    """Order to drive to a goal, with its expiry.

    Attributes:
        challenge: Challenge of the robot's newest report.  Every hold and resume makes
            a new one, so that no copy of the order outlives a STOP.
        until_s: Expiry on the robot's own monotonic clock (s).
    """

    challenge: Annotated[str, Strict(), Field(min_length=1, alias="ch")]
    until_s: Annotated[float, Strict(), Field(alias="until", allow_inf_nan=False)]


@with_config(extra="forbid")
@dataclass(frozen=True, slots=True)
class CancelOrder:
    """Order to drop a goal and to stay."""

    goal_id: GoalId


REASONS: Mapping[str, str] = {
    "recording": "it plays a recording",
    "held": "a STOP or another hold keeps it where it is",
    "doubt": "its data contradict each other",
    "no_pose": "its position is not recent",
    "no_report": "its safety report is not recent",
    "no_clock": "its messages do not tell its own clock (mono)",
    "outside": "the place is outside the greenhouse",
    "in_plants": "the place is in the plants",
    "obstacle": "something stands at the place",
    "no_such_aisle": "the greenhouse has no aisle of that label",
    "no_start": "the greenhouse does not say where it belongs",
    "no_goal": "it has no goal",
}


def refusal(robot_id: str, why: str) -> CommandRefusedError:
    """Error that refuses a goal for a reason of the table."""
    return CommandRefusedError(robot_id, "goal", why, REASONS[why])


_STEP_M = 0.25


@dataclass(frozen=True, slots=True)
class GoalWish:
    """Request of a person for a goal.

    Attributes:
        x: Position for ``here``, in ``map`` (m); ``y`` likewise.
        aisle: Label of the lane for ``aisle``.
    """

    kind: GoalKind
    x: float = 0.0
    y: float = 0.0
    aisle: str | None = None


def place_of(
    wish: GoalWish,
    greenhouse: Greenhouse,
    profile: RobotProfile,
    pose: Pose2D,
    start: Pose2D | None,
) -> tuple[float, float] | str:
    """Place of a wish in ``map`` (m), or the code of its refusal.

    Args:
        wish: The wish.
        greenhouse: Greenhouse with its plants, posts and obstacles.
        profile: Body of the robot: half its width must be free about the place.
        pose: Present pose of the robot.
        start: Pose where the robot belongs; None: unknown.
    """
    keep_off_m = profile.width / 2
    place = wish.x, wish.y
    match wish.kind:
        case "pause":
            # Not checked: a robot must be able to stay wherever it is.
            return pose.x, pose.y
        case "return":
            if start is None:
                return "no_start"
            place = start.x, start.y
        case "aisle":
            lanes = (lane for lane in greenhouse.lanes if lane.label == wish.aisle)
            lane = next(lanes, None)
            if lane is None:
                return "no_such_aisle"
            for place in _from_the_middle(lane.area):
                if _obstructed(greenhouse, *place, keep_off_m) is None:
                    return place
            return "obstacle"
    return _obstructed(greenhouse, *place, keep_off_m) or place


def _obstructed(
    greenhouse: Greenhouse, x: float, y: float, keep_off_m: float
) -> str | None:
    """Code of the obstruction of a place; None where a robot fits."""
    if not greenhouse.bounds.contains(x, y, -keep_off_m):
        return "outside"
    if any(row.contains(x, y, keep_off_m) for row in greenhouse.rows):
        return "in_plants"
    things = any(
        thing.area.contains(x, y, keep_off_m) for thing in greenhouse.obstacles
    )
    posts = any(
        Pose2D(post.x, post.y, 0.0).distance_to(x, y) <= post.radius + keep_off_m
        for post in greenhouse.posts
    )
    return "obstacle" if things or posts else None


def _from_the_middle(area: Rectangle) -> Iterator[tuple[float, float]]:
    """Places on the middle line of a lane (m), from its middle outwards."""
    x, y = area.middle
    along_x = area.xmax - area.xmin >= area.ymax - area.ymin
    half = (area.xmax - area.xmin if along_x else area.ymax - area.ymin) / 2
    for step in range(int(half / _STEP_M) + 1):
        for offset in (step * _STEP_M, -step * _STEP_M):
            yield (x + offset, y) if along_x else (x, y + offset)


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
"""Time without an answer of the robot after which an order is unconfirmed (s)."""

OPEN_STATES: tuple[GoalState, ...] = ("SENT", "DRIVING", "UNCONFIRMED", "CANCELLING")
_TABLE: Mapping[tuple[GoalState, GoalEvent], GoalState] = {
    ("SENT", "accepted"): "DRIVING",
    ("SENT", "refused"): "REFUSED",
    ("SENT", "expired"): "UNCONFIRMED",
    ("UNCONFIRMED", "accepted"): "DRIVING",
    ("UNCONFIRMED", "refused"): "REFUSED",
    ("CANCELLING", "refused"): "REFUSED",
    ("CANCELLING", "expired"): "UNCONFIRMED",
    **{(state, "reached"): "REACHED" for state in ("SENT", "DRIVING", "UNCONFIRMED")},
    **{(state, "cancel"): "CANCELLING" for state in ("SENT", "DRIVING", "UNCONFIRMED")},
    **{(state, "dropped"): "CANCELLED" for state in OPEN_STATES},
    **{(state, "held"): "DELETED" for state in OPEN_STATES},
    **{(state, "replaced"): "REPLACED" for state in OPEN_STATES},
}


@dataclass(frozen=True, slots=True)
class FollowedGoal:
    """One goal, from the wish of a person to its end.

    Attributes:
        by: Name of the person.
        sent: Time of its order.
        ordered: Time of the newest order: the goal, or its cancellation.
        aisle: Label of the lane that the person named.
        why: Code of the robot's refusal.
        answered: First answer of the robot.
        ended: Time of the change to a state that is not open.
        forgotten: First report of the robot that it does not drive to the goal.
    """

    robot_id: str
    goal: Goal
    by: str
    sent: Instant
    ordered: Instant
    aisle: str | None = None
    state: GoalState = "SENT"
    why: str | None = None
    answered: Instant | None = None
    ended: Instant | None = None
    forgotten: Instant | None = None

    @property
    def is_open(self) -> bool:
        """Whether the robot may be on its way."""
        return self.state in OPEN_STATES

    def after(
        self, event: GoalEvent, at: Instant, why: str | None = None
    ) -> "FollowedGoal":
        """The goal after an event; the same object where the event changes nothing."""
        state = _TABLE.get((self.state, event))
        if state is None:
            return self
        is_answer = event in ("accepted", "refused", "reached", "dropped")
        return replace(
            self,
            state=state,
            why=why,
            ordered=at if event == "cancel" else self.ordered,
            answered=at if is_answer and self.answered is None else self.answered,
            ended=None if state in OPEN_STATES else at,
        )

    def is_overdue(self, now: Instant) -> bool:
        """Whether the time to answer the newest order is over."""
        return now.mono - self.ordered.mono > ANSWERED_WITHIN_S


def permit(robot: RobotState, stop_state: str, goal: Goal, now: Instant) -> GoalOrder:
    """Order for a goal to a robot that is free to drive.

    Args:
        robot: The robot.
        stop_state: State of its STOP machine.
        goal: The goal.
        now: This moment.

    Raises:
        CommandRefusedError: the robot is not free; with the code of the reason.
    """
    report, reason = robot.safety, _why_not(robot, stop_state, now)
    if reason is None and report is not None:
        until_s = _own_clock(robot, report)
        if report.challenge is not None and until_s is not None:
            # The robot drops the order when iVeg stops waiting for its answer.
            until_s += ANSWERED_WITHIN_S
            return GoalOrder(
                goal.goal_id, goal.kind, goal.x, goal.y, report.challenge, until_s
            )
        reason = "no_clock"
    raise refusal(robot.robot_id, reason or "no_report")


def _why_not(robot: RobotState, stop_state: str, now: Instant) -> str | None:
    """Code of the first reason against any goal; None: the robot is free to drive."""
    report, received = robot.safety, robot.safety_received
    if robot.is_replay:
        return "recording"
    if stop_state != "RUNNING":
        return "held"
    if robot.doubts.active(now):
        return "doubt"
    if robot.link(now) != "LIVE":
        return "no_pose"
    age_s = inf if received is None else now.mono - received.mono
    if report is None or age_s > LIMITS.report_fresh_s:
        return "no_report"
    # A robot that waits for its resume has no hold, and reports 0 with reason ``hold``.
    return "held" if report.holds or report.reason == "hold" else None


def _own_clock(robot: RobotState, report: SafetyReport) -> float | None:
    """Newest known moment of the robot's own clock in its present boot (s)."""
    origins = [report.origin, *([robot.odometry.origin] if robot.odometry else [])]
    # Each boot has a monotonic clock of its own: moments of another one do not count.
    moments = [
        origin.mono
        for origin in origins
        if origin.mono is not None and origin.boot == report.origin.boot
    ]
    return max(moments, default=None)
