"""Whether a robot may be given a goal now, by all that iVeg knows of it."""

from iveg.domain.goals.followed import ANSWERED_WITHIN_S
from iveg.domain.goals.orders import Goal, GoalOrder
from iveg.domain.goals.refusals import refusal
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.robot_state import RobotState


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
        one.mono
        for one in origins
        if one.mono is not None and one.boot == report.origin.boot
    ]
    return max(moments, default=None)
