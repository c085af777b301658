"""Log lines about speeds and alerts: template, and what fills its holes."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from iveg.domain.alerts import BookedAlert
from iveg.domain.decisions import Decisions
from iveg.domain.events import LogEvent, Slot
from iveg.domain.feedback import FULL_SPEED
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import SafetyReport
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.clear import ClearCondition
from iveg.domain.rule.zones import ZoneEntry
from iveg.domain.tracking.people import People
from iveg.domain.world import World


@dataclass(frozen=True, slots=True)
class SlowdownCauses:
    """The detection behind a slow-down, and its distance from the robot (m).

    Attributes:
        decision_id: The decision that opens; None where the robot was ahead of ours.
        radius_m: Of the zone that it came into, where it had grown: the cause was not
            in view for ``unseen_s`` seconds.
    """

    cause: str
    class_: str
    observer: str
    distance_m: float
    in_sight: bool
    confidence: float | None = None
    decision_id: str | None = None
    radius_m: float | None = None
    unseen_s: float | None = None


def evidence_of(
    report: SafetyReport,
    decisions: Decisions,
    people: People,
    world: World,
    greenhouse: Greenhouse,
) -> SlowdownCauses | None:
    """Facts behind the reason that a robot reports; None when iVeg has none.

    A robot judges alerts by its own pose, too, and may be ahead of our decision; it
    then names the alert, and that person's data are the evidence.
    """
    if report.reason not in ("person", "robot"):
        return None
    decision = decisions.get(report.decision_id or "")
    if decision is not None:
        return _of_entry(decision.entry)
    robot = world.robots[report.robot_id]
    found = _without_decision(report, robot, people, world, greenhouse)
    if found is None:
        return None
    ours = (
        one.decision_id
        for one in decisions.open
        if (one.entry.robot_id, one.entry.zone.cause) == (robot.robot_id, found.cause)
    )
    return replace(found, decision_id=next(ours, None))


def _without_decision(
    report: SafetyReport,
    robot: RobotState,
    people: People,
    world: World,
    greenhouse: Greenhouse,
) -> SlowdownCauses | None:
    for person in people.known.values():
        if report.decision_id == person.decision_id:
            look = person.newest
            sure = None if look.laser else look.confidence
            facts = look.x, look.y, look.observer, sure
            name, class_ = person.person_id, person.class_
            return _seen_by(robot, greenhouse, name, class_, *facts)
    peer = world.robots.get(report.cause or "")
    if peer is None or peer.odometry is None:
        return None
    pose, name = peer.odometry.pose, peer.robot_id
    return _seen_by(robot, greenhouse, name, "robot", pose.x, pose.y, name)


def _of_entry(entry: ZoneEntry) -> SlowdownCauses:
    zone, sighting = entry.zone, entry.zone.sighting
    confidence = None
    if sighting is not None and not sighting.laser:
        confidence = sighting.confidence
    unseen = None if sighting is None else sighting.age_s(entry.entered)
    grown = unseen is not None and unseen > LIMITS.growth_grace_s
    return SlowdownCauses(
        zone.cause,
        zone.reason,
        zone.observer,
        entry.entered_m,
        entry.in_sight,
        confidence,
        entry.decision_id,
        zone.radius_m if grown else None,
        unseen if grown else None,
    )


def _seen_by(
    robot: RobotState,
    greenhouse: Greenhouse,
    cause: str,
    class_: str,
    x: float,
    y: float,
    observer: str,
    confidence: float | None = None,
) -> SlowdownCauses | None:
    """How far a cause at x, y (m) is from a robot, and whether it may see it."""
    if robot.odometry is None:
        return None
    pose = robot.odometry.pose
    sees = observer == robot.robot_id or greenhouse.in_sight(pose.x, pose.y, x, y)
    distance_m = pose.distance_to(x, y)
    return SlowdownCauses(cause, class_, observer, distance_m, sees, confidence)


def _first_of(
    unmet: Iterable[ClearCondition], report: SafetyReport
) -> ClearCondition | None:
    """The unmet condition that a robot reports as its reason."""
    reported = report.reason, report.cause
    return next(
        (one for one in unmet if (one.limit_reason, one.robot_id) == reported), None
    )


def speed_line(
    report: SafetyReport,
    evidence: SlowdownCauses | None,
    unmet: Iterable[ClearCondition] = (),
) -> LogEvent:
    """A robot applies another factor than before, and why.

    ``unmet``: conditions of "clear" that do not hold; an old pose is like
    any old data.
    """
    slots: dict[str, Slot] = {
        "robot": report.robot_id,
        "factor": report.speed_factor,
        "reason": report.reason,
        "cause": report.cause,
    }
    key = "log.speed_up"
    if report.speed_factor < FULL_SPEED:
        key = f"log.speed_down.{report.reason}"
        lacks = _first_of(unmet, report)
        if lacks is not None and lacks.reason != "pose":
            key = f"log.speed_down.{lacks.reason}"
            slots["observer"] = lacks.robot_id
        if evidence is not None:
            if evidence.class_ == "person" and evidence.confidence is None:
                key = "log.speed_down.walker"
            key += "" if evidence.in_sight else "_nlos"
            slots |= {
                "distance": round(evidence.distance_m, 2),
                "observer": evidence.observer,
                "person": evidence.cause,
                "class": evidence.class_,
                "confidence": evidence.confidence,
                "in_sight": evidence.in_sight,
            }
            if evidence.radius_m is not None and evidence.unseen_s is not None:
                slots["radius"] = round(evidence.radius_m, 2)
                slots["unseen"] = round(evidence.unseen_s, 1)
    return LogEvent(
        "speed",
        key,
        slots,
        report.robot_id,
        None if evidence is None else evidence.class_,
        None if evidence is None else evidence.decision_id,
    )


def alert_line(alert: BookedAlert) -> LogEvent:
    """An alert was raised or cleared."""
    condition = alert.condition
    key = "log.alert.raised" if alert.cleared is None else "log.alert.cleared"
    slots: dict[str, Slot] = {
        **condition.slots,
        "alert": condition.key,
        "priority": alert.priority,
    }
    return LogEvent("alert", key, slots, condition.robot_id)
