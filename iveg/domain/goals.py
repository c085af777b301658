"""Goals that people give to robots, below STOP in every respect (docs/safety.md).

A goal lies in the greenhouse, and in no plant, post or crate; ``REASONS`` has the codes
of the contract (docs/interfaces/commands.md) for a goal that is refused.  Its life is a
table: state × event → new state. ::

    SENT ──accepted──> DRIVING ──reached──> REACHED      SENT ──refused──> REFUSED
      └──expired──> UNCONFIRMED: nobody sends it again, and a late word still counts
    SENT, DRIVING, UNCONFIRMED ──cancel──> CANCELLING ──dropped──> CANCELLED
                                               └──expired──> UNCONFIRMED
    every open state ──held──> DELETED        every open state ──replaced──> REPLACED

A pair without a row changes nothing: what has ended stays ended.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from iveg.domain.errors import CommandRefusedError
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.robot_state import RobotState

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
    """The error that refuses a goal for a reason of the table."""
    return CommandRefusedError(robot_id, "goal", why, REASONS[why])


_STEP_M = 0.25


@dataclass(frozen=True, slots=True)
class GoalWish:
    """A person's wish.

    Attributes:
        x: Of ``here``, in ``map`` (m); ``y`` too.
        aisle: Label of a lane, for ``aisle``.
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
    """The place that is meant (m), or the code of what is wrong with it.

    Args:
        wish: The wish.
        greenhouse: What stands there.
        profile: Body of the robot: half its width must be free about the place.
        pose: Where the robot is.
        start: Where it belongs; None where nobody knows.
    """
    keep_off_m = profile.width / 2
    place = wish.x, wish.y
    match wish.kind:
        case "pause":
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
    """Code of what stands at a place; None where a robot fits."""
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
    """Places on the middle line of a lane, from its middle outwards."""
    x, y = area.middle
    along_x = area.xmax - area.xmin >= area.ymax - area.ymin
    half = (area.xmax - area.xmin if along_x else area.ymax - area.ymin) / 2
    for step in range(int(half / _STEP_M) + 1):
        for away in (step * _STEP_M, -step * _STEP_M):
            yield (x + away, y) if along_x else (x, y + away)


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
    **{(state, "reached"): "REACHED" for state in ("SENT", "DRIVING", "UNCONFIRMED")},
    **{(state, "cancel"): "CANCELLING" for state in ("SENT", "DRIVING", "UNCONFIRMED")},
    **{(state, "dropped"): "CANCELLED" for state in OPEN_STATES},
    **{(state, "held"): "DELETED" for state in OPEN_STATES},
    **{(state, "replaced"): "REPLACED" for state in OPEN_STATES},
}


@dataclass(frozen=True, slots=True)
class FollowedGoal:
    """One goal from a person's wish to its end.

    Attributes:
        by: The person who gave it.
        sent: When; ``answered``: the robot's first word; ``ended``: its last change.
        asked: When the robot was last asked something: goal or cancellation.
        why: Code of the robot's refusal.
        forgotten: When the robot itself first said that it drives to it no longer.
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

    def is_overdue(self, now: Instant) -> bool:
        """Whether what was asked last can be answered no more."""
        return now.mono - self.asked.mono > ANSWERED_WITHIN_S


def permit(robot: RobotState, stop_state: str, goal: Goal, now: Instant) -> GoalOrder:
    """The order that gives a goal to a robot that is free to drive.

    Args:
        robot: The robot.
        stop_state: State of its STOP machine.
        goal: The goal.
        now: This moment.

    Raises:
        CommandRefusedError: it is not, with the code of the reason.
    """
    report, why = robot.safety, _why_not(robot, stop_state, now)
    if why is None and report is not None:
        until_s = _own_clock(robot, report)
        if report.challenge is not None and until_s is not None:
            return GoalOrder(goal, report.challenge, until_s + ANSWERED_WITHIN_S)
        why = "no_clock"
    raise refusal(robot.robot_id, why or "no_report")


def _why_not(robot: RobotState, stop_state: str, now: Instant) -> str | None:
    """Code of the first reason against any goal."""
    report, received = robot.safety, robot.safety_received
    if robot.is_replay:
        return "recording"
    if stop_state != "RUNNING":
        return "held"
    if robot.doubts.active(now):
        return "doubt"
    if robot.link(now) != "LIVE":
        return "no_pose"
    if report is None or received is None:
        return "no_report"
    if now.mono - received.mono > LIMITS.report_fresh_s:
        return "no_report"
    # A robot that waits for its resume has no hold any more, and says 0, ``hold``.
    return "held" if report.holds or report.reason == "hold" else None


def _own_clock(robot: RobotState, report: SafetyReport) -> float | None:
    """The newest moment of the robot's own clock that it told (s), in this boot."""
    origins = [report.origin, *([robot.odometry.origin] if robot.odometry else [])]
    moments = [
        origin.mono
        for origin in origins
        if origin.mono is not None and origin.boot == report.origin.boot
    ]
    return max(moments, default=None)
