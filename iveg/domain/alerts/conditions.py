"""The alert conditions that hold now, from decisions and robots (docs/dashboard.md)."""

from collections.abc import Iterable
from math import inf

from iveg.domain.alerts.alert_book import Condition
from iveg.domain.decisions import SlowdownDecision
from iveg.domain.detection_rule import RECOVERED, DetectionRule
from iveg.domain.events import Slot
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState

ESTIMATED_SHOWN_AFTER_S = 5.0
"""Time that a robot may take to receive its first feedback (s)."""
DETECTOR_STARTS_S = 10.0
"""Time that a fleet may take to send its first detection frames after iVeg's start."""
SHOWN_S = 10.0
"""How long after it was last so a condition is reported (s): one at its bound is one
alert and not one a second."""


def of_decision(decision: SlowdownDecision, now: Instant) -> Iterable[Condition]:
    """A decision that is not obeyed is a P1; a slow-down as such is no alert.

    The slow-down is on the robot's card, on the map and in the log.
    """
    crossing = decision.crossing
    slots: dict[str, Slot] = {
        "robot": crossing.robot_id,
        "person": crossing.zone.cause,
        "distance": round(crossing.distance_m, 2),
        "decision": decision.decision_id,
    }
    subject = f"{crossing.robot_id}/{crossing.zone.cause}"
    person = crossing.zone.reason == "person"
    if decision.overdue(now):
        key = "alert.person_not_slowing" if person else "alert.no_slow_down"
        yield Condition("P1", key, subject, crossing.robot_id, slots)


def of_robot(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """A robot that is lost, doubted, or whose clock or detector is off."""
    slots: dict[str, Slot] = {"robot": robot.robot_id}
    name = robot.robot_id
    if robot.link(now) == "LOST":
        moving = _was_moving(robot)
        key = "alert.moving_robot_lost" if moving else "alert.robot_lost"
        yield Condition("P1" if moving else "P2", key, name, name, slots)
    offset = robot.clock.warning(now, _may_be_late_s(robot, now))
    if offset is not None:
        slots = {**slots, "offset": round(offset, 2)}
        yield Condition("P3", "alert.clock_offset", name, name, slots)
    doubts = robot.doubts.active(now)
    if doubts:
        slots = {"robot": name, "code": doubts[0]}
        yield Condition("P2", "alert.doubt", name, name, slots)


def of_detector(
    robot: RobotState, now: Instant, *, started: Instant
) -> Iterable[Condition]:
    """A detector whose pictures are not read whole; ``started``: when iVeg did."""
    name, detector = robot.robot_id, robot.detector
    slots: dict[str, Slot] = {"robot": name}
    if not robot.description.has_detector:
        return
    if _is_recent(detector.flawed_at.get("unreadable"), now):
        yield Condition("P2", "alert.unreadable_detection", name, name, slots)
    if _is_recent(robot.clock.detector_apart_at, now):
        yield Condition("P2", "alert.detector_clock", name, name, slots)
    if _is_silent(robot, now, started):
        yield Condition("P2", "alert.detector_silent", name, name, slots)
    if detector.out_of_service is not None:
        slots = {**slots, "by": detector.out_of_service.by}
        yield Condition("P3", "alert.detector_out_of_service", name, name, slots)


def _is_silent(robot: RobotState, now: Instant, started: Instant) -> bool:
    """Whether people are to look after it: not while it starts, nor of a lost robot."""
    detector = robot.detector
    if detector.is_flawed(now) or not detector.is_missing(now):
        return False
    if robot.link(now) == "LOST":
        return False
    if _is_recent(robot.clock.detector_apart_at, now, LIMITS.silence_s):
        return False  # it speaks, by another clock
    if detector.whole_at is not None and robot.pose_at is not None:
        # Else all of it is late or has just come back: the robot itself is reported.
        is_alive = now.mono - (robot.alive_since or now.mono) > LIMITS.silence_s
        return is_alive and robot.pose_at - detector.whole_at > LIMITS.silence_s
    return detector.worked or now.mono - started.mono >= DETECTOR_STARTS_S


def of_kind(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """A robot whose messages contradict its kind in the fleet: live or recording."""
    slots: dict[str, Slot] = {"robot": robot.robot_id}
    name = robot.robot_id
    if _is_recent(robot.live_at, now):
        yield Condition("P1", "alert.recording_is_live", name, name, slots)
    if _is_recent(robot.refused_at, now):
        yield Condition("P2", "alert.replay_refused", name, name, slots)


def _is_recent(moment: float | None, now: Instant, within_s: float = SHOWN_S) -> bool:
    return moment is not None and now.mono - moment < within_s


def _may_be_late_s(robot: RobotState, now: Instant) -> float:
    """Greatest delay of the messages of a robot that echoes (s); else 0."""
    if robot.odometry is None or not robot.odometry.origin.acknowledgements:
        return 0.0
    age = robot.age_s(now)
    return inf if age is None else age


def _was_moving(robot: RobotState) -> bool:
    """Whether the robot moved in its last report or odometry, the newer of both."""
    report, at = robot.safety, robot.safety_received
    if report is None or at is None or at.mono < (robot.pose_at or 0.0):
        return not robot.stands
    return max(abs(report.linear), abs(report.angular)) >= LIMITS.standing_speed


def of_overload(robots: Iterable[RobotState], now: Instant) -> Iterable[Condition]:
    """Detectors with more detections than can be judged: one alert names them all."""
    names = [
        robot.robot_id
        for robot in robots
        if _is_recent(robot.detector.flawed_at.get("overload"), now)
    ]
    if names:
        slots: dict[str, Slot] = {"robots": ", ".join(sorted(names))}
        yield Condition("P2", "alert.pictures_not_judged", "fleet", None, slots)


def of_rule(rule: DetectionRule) -> Iterable[Condition]:
    """The rule in force was made from a damaged file, and nobody has looked at it."""
    if rule.author == RECOVERED:
        slots: dict[str, Slot] = {"version": rule.version}
        yield Condition("P2", "alert.rule_recovered", "fleet", None, slots)


def of_fleet(robots: Iterable[RobotState], now: Instant) -> Iterable[Condition]:
    """Estimated ages, no description, boxes without a frame: one alert each."""
    fleet = list(robots)
    estimated = [
        robot.robot_id
        for robot in fleet
        if robot.estimated_since is not None
        and now.mono - robot.estimated_since > ESTIMATED_SHOWN_AFTER_S
    ]
    unlabelled = [
        one.robot_id
        for one in fleet
        if one.unlabelled and one.profile.unlabelled_frame is None
    ]
    undescribed = [one.robot_id for one in fleet if not one.description.is_described]
    for key, names in (
        ("alert.age_estimated", estimated),
        ("alert.robots_not_described", undescribed),
        ("alert.frame_not_named", unlabelled),
    ):
        if names:
            slots: dict[str, Slot] = {"robots": ", ".join(names)}
            yield Condition("P3", key, "fleet", None, slots)
