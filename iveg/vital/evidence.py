"""Evidence in words: decisions as rows; speeds, alerts and marks as log lines."""

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace

from iveg.domain.alerts import BookedAlert
from iveg.domain.decisions import Decisions, Link, Place, SlowdownDecision
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.events import LogEvent, Slot
from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import SafetyReport
from iveg.domain.parameters import for_class
from iveg.domain.records import DecisionRecord
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.clear import ClearCondition
from iveg.domain.rule.zones import Zone, ZoneEntry
from iveg.domain.stamps import wall_of
from iveg.domain.tracking.looks import Looks
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Thing
from iveg.domain.world import World


def record_of(decision: SlowdownDecision) -> DecisionRecord:
    """The whole chain as it stands; open links may yet come."""
    entry = decision.entry
    zone, sighting = entry.zone, entry.zone.sighting
    return DecisionRecord(
        decision_id=decision.decision_id,
        kind="mandate",
        robot_id=entry.robot_id,
        started_at=entry.entered.wall,
        person_id=zone.cause,
        observer=zone.observer,
        class_=zone.reason,
        class_id=None if sighting is None else sighting.class_id,
        confidence=None if sighting is None or sighting.laser else sighting.confidence,
        x=zone.x,
        y=zone.y,
        z=None if sighting is None else sighting.z,
        distance_m=entry.entered_m,
        speed_factor=HALF_SPEED,
        reason=zone.reason,
        rule_id=decision.rule.id,
        rule_version=str(decision.rule.version),
        rule_parameters={
            **_parameters(decision.rule, zone),
            "foretold_s": entry.foretold_s,
            "places": [asdict(one) for one in decision.places],
        },
        in_sight=entry.in_sight,
        feedback_at=wall_of(decision.feedback),
        applied_at=wall_of(decision.applied),
        observed_at=wall_of(decision.observed),
        ended_at=wall_of(decision.ended),
        speed_before=entry.speed_before,
        speed_after=decision.speed_after,
        links=[write_link(link) for link in decision.links()],
    )


def places_of(entry: ZoneEntry, world: World) -> Iterator[Place]:
    """Places of the slowed robot and the observer now, where they are known."""
    for robot_id in dict.fromkeys((entry.robot_id, entry.zone.observer)):
        robot = world.robots.get(robot_id or "")
        if robot is not None and robot.odometry is not None:
            pose = robot.odometry.pose
            yield Place(
                robot.robot_id, round(pose.x, 3), round(pose.y, 3), round(pose.yaw, 4)
            )


def left_behind(record: DecisionRecord, found: float) -> DecisionRecord:
    """Close a decision that an earlier run left open, with an unknown end.

    Args:
        record: As the crash left it.
        found: When this run found it (Unix s).
    """
    links = [
        {**link, "verdict": "unknown"} if link["verdict"] == "open" else link
        for link in record.links
    ]
    links.append(write_link(Link("interrupted", "unknown", found)))
    return replace(record, ended_at=found, links=links)


def _parameters(rule: DetectionRule, zone: Zone) -> dict[str, object]:
    sighting = zone.sighting
    looks = None if sighting is None else sighting.looks
    return {
        **for_class(rule, zone.reason),
        "ring_m": round(zone.radius_m, 3),
        "author": rule.author,
        "possible": sighting is not None and (sighting.possible or sighting.laser),
        "looks": None if looks is None else _looks(looks),
    }


def _looks(looks: Looks) -> dict[str, object]:
    document = asdict(looks) | {"probability": round(looks.probability, 4)}
    del document["confirmed"]
    return document


def write_link(link: Link) -> dict[str, object]:
    """A link as it is stored."""
    return {
        "link": link.name,
        "at": link.at,
        "value": link.value,
        "verdict": link.verdict,
    }


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
    """Distance of a cause at x, y (m) from a robot, and whether it may see it."""
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


def alert_line(step: str, alert: BookedAlert, **also: Slot) -> LogEvent:
    """An alert was raised, cleared or acknowledged."""
    condition, key = alert.condition, alert.condition.key
    slots = {**condition.slots, "alert": key, "priority": alert.priority, **also}
    return LogEvent("alert", f"log.alert.{step}", slots, condition.robot_id)


def thing_line(key: str, thing: Thing, by: str) -> LogEvent:
    """A line of the log: a mark was made, taken back, or is over."""
    place = {"x": round(thing.x, 2), "y": round(thing.y, 2)}
    return LogEvent("system", key, {"by": by, **place})
