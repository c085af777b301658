"""The alert conditions that hold now, from decisions and robots (docs/dashboard.md)."""

from collections.abc import Iterable
from math import inf

from iveg.domain.camera_bias import WARN_M
from iveg.domain.decisions import SlowdownDecision
from iveg.domain.detection_rule import RECOVERED, DetectionRule
from iveg.domain.events import Condition, Slot
from iveg.domain.limits import LIMITS
from iveg.domain.messages import Priority
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.things import Thing

ESTIMATED_SHOWN_AFTER_S = 5.0
"""Time that a robot may take to receive its first feedback (s)."""
DETECTOR_STARTS_S = 10.0
"""Time that a fleet may take to send its first detection frames after iVeg's start."""
SHOWN_S = 10.0
"""How long after it was last so a condition is reported (s): one at its bound is one
alert and not one a second."""


def of_decision(decision: SlowdownDecision) -> Iterable[Condition]:
    """A decision that is not obeyed is a P1; a slow-down as such is no alert.

    The slow-down is on the robot's card, on the map and in the log.
    """
    crossing = decision.crossing
    zone, robot_id = crossing.zone, crossing.robot_id
    if not decision.is_overdue:
        return
    is_person = zone.reason == "person"
    key = "alert.person_not_slowing" if is_person else "alert.no_slow_down"
    slots: dict[str, Slot] = {
        "robot": robot_id,
        "person": zone.cause,
        "distance": round(crossing.distance_m, 2),
        "decision": decision.decision_id,
    }
    yield Condition("P1", key, f"{robot_id}/{zone.cause}", robot_id, slots)


def of_robot(robot: RobotState, now: Instant) -> Iterable[Condition]:
    """A robot that is lost, doubted, or whose clock or detector is off."""
    name = robot.robot_id
    if robot.link(now) == "LOST":
        if _was_moving(robot):
            yield Condition.of_robot("P1", "alert.moving_robot_lost", name)
        else:
            yield Condition.of_robot("P2", "alert.robot_lost", name)
    if robot.revoked is not None:
        by = robot.revoked.by
        yield Condition.of_robot("P3", "alert.robot_revoked", name, by=by)
    offset = robot.clock.warning(now, _may_be_late_s(robot, now))
    if offset is not None:
        shown = round(offset, 2)
        yield Condition.of_robot("P3", "alert.clock_offset", name, offset=shown)
    for code in robot.doubts.active(now)[:1]:
        yield Condition.of_robot("P2", "alert.doubt", name, code=code)


def of_laser(robot_id: str, fault: str | None) -> Iterable[Condition]:
    """A laser that is no witness: told, and everything else goes on."""
    if fault is not None:
        yield Condition.of_robot("P3", f"alert.laser_{fault}", robot_id)


def of_detector(
    robot: RobotState, now: Instant, *, started: Instant
) -> Iterable[Condition]:
    """A detector whose pictures are not read whole; ``started``: when iVeg did."""
    name, detector = robot.robot_id, robot.detector
    if not robot.description.has_detector:
        return
    if _is_recent(detector.flawed_at.get("unreadable"), now) or _is_unplaced(
        robot, now, started
    ):
        yield Condition.of_robot("P2", "alert.unreadable_detection", name)
    if _is_recent(robot.clock.detector_accused_at, now):
        yield Condition.of_robot("P2", "alert.detector_clock", name)
    if _is_silent(robot, now, started):
        yield Condition.of_robot("P2", "alert.detector_silent", name)
    if detector.out_of_service is not None:
        by = detector.out_of_service.by
        yield Condition.of_robot("P3", "alert.detector_out_of_service", name, by=by)
    bias = detector.peer_looks.bias(now)
    if bias is not None and bias.off_m > WARN_M:
        off = round(bias.off_m, 2)
        yield Condition.of_robot("P3", "alert.camera_bias", name, off=off)
    carried = detector.carried.found(now.mono)
    if carried is not None:
        ahead, left = (round(one, 1) for one in carried.place)
        yield Condition.of_robot("P3", "alert.carried", name, ahead=ahead, left=left)


def of_things(things: Iterable[Thing]) -> Iterable[Condition]:
    """Places where an operator said that nobody is, or what stands there."""
    for one in things:
        slots: dict[str, Slot] = {"x": round(one.x, 2), "y": round(one.y, 2)}
        slots["by"] = one.by
        is_person = one.kind == "person"
        key = "alert.thing_marked" if is_person else "alert.known_marked"
        yield Condition("P3", key, one.thing_id, None, slots)


def _is_unplaced(robot: RobotState, now: Instant, started: Instant) -> bool:
    """Whether it still sees somebody without knowing where it is: not while it starts.

    A robot's first pictures may come before its first odometry.
    """
    unplaced_at = robot.detector.flawed_at.get("unplaced")
    is_starting = now.mono - started.mono < DETECTOR_STARTS_S
    return not is_starting and _is_recent(unplaced_at, now, LIMITS.silence_s)


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
    name = robot.robot_id
    if _is_recent(robot.live_at, now):
        yield Condition.of_robot("P1", "alert.recording_is_live", name)
    if _is_recent(robot.refused_at, now):
        yield Condition.of_robot("P2", "alert.replay_refused", name)


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
        yield _of_all("P2", "alert.pictures_not_judged", sorted(names))


def of_rule(rule: DetectionRule) -> Iterable[Condition]:
    """The rule in force was made from a damaged file, and nobody has looked at it."""
    if rule.author == RECOVERED:
        slots = {"version": rule.version}
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
            yield _of_all("P3", key, names)


def _of_all(priority: Priority, key: str, names: Iterable[str]) -> Condition:
    """One condition that names every robot concerned."""
    return Condition(priority, key, "fleet", None, {"robots": ", ".join(names)})
