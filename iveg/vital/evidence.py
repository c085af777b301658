"""Evidence in words: decisions as rows; speeds, alerts and marks as log lines."""

from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace

from iveg.domain.alerts import BookedAlert
from iveg.domain.decisions import Decisions, Link, Place, SlowdownDecision
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.events import LogEvent, Slot
from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import SafetyReport
from iveg.domain.parameters import for_class
from iveg.domain.records import DecisionRecord
from iveg.domain.rule.clear import ClearCondition
from iveg.domain.rule.zones import Zone, ZoneEntry
from iveg.domain.stamps import wall_of
from iveg.domain.tracking.looks import Looks
from iveg.domain.tracking.things import Thing
from iveg.domain.tracking.tracker import Sighting
from iveg.domain.world import World


def record_of(decision: SlowdownDecision) -> DecisionRecord:
    """Row of a decision with its chain so far; open links may still come."""
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
        confidence=_confidence(sighting),
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
            "places": [asdict(place) for place in decision.places],
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


def _confidence(sighting: Sighting | None) -> float | None:
    """Confidence of a sighting; None for a laser track or a peer's own pose."""
    return None if sighting is None or sighting.laser else sighting.confidence


def places_of(entry: ZoneEntry, world: World) -> Iterator[Place]:
    """Present places of the slowed robot and the observer, where known."""
    for robot_id in dict.fromkeys((entry.robot_id, entry.zone.observer)):
        robot = world.robots.get(robot_id or "")
        if robot is not None and robot.odometry is not None:
            pose = robot.odometry.pose
            yield Place(
                robot.robot_id, round(pose.x, 3), round(pose.y, 3), round(pose.yaw, 4)
            )


def left_behind(record: DecisionRecord, closed_at: float) -> DecisionRecord:
    """Close a decision that an earlier run left open, with an unknown end.

    Args:
        record: Its newest stored state.
        closed_at: Time at which this run closes it (Unix s).
    """
    # Unknown and not missing: the robot may have slowed after iVeg ended.
    links = [
        {**link, "verdict": "unknown"} if link["verdict"] == "open" else link
        for link in record.links
    ]
    links.append(write_link(Link("interrupted", "unknown", closed_at)))
    return replace(record, ended_at=closed_at, links=links)


def _parameters(rule: DetectionRule, zone: Zone) -> dict[str, object]:
    sighting = zone.sighting
    looks = None if sighting is None else sighting.looks
    return {
        **for_class(rule, zone.reason),
        # Stored rows have this key.
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
    """Stored form of a link."""
    return {
        "link": link.name,
        "at": link.at,
        "value": link.value,
        "verdict": link.verdict,
    }


def cause_of(report: SafetyReport, decisions: Decisions) -> ZoneEntry | None:
    """Zone entry behind a robot's report, by the decision or alert that it names.

    A robot also judges alerts by its own pose.  Before iVeg has decided, it names the
    alert, and no decision exists yet.
    """
    named = report.decision_id
    decision = decisions.get(named or "")
    if decision is not None:
        return decision.entry
    for decision in decisions.open:
        entry, zone = decision.entry, decision.entry.zone
        is_named = zone.cause == report.cause or (named and zone.alert_id == named)
        if is_named and entry.robot_id == report.robot_id:
            return entry
    return None


def speed_line(
    report: SafetyReport,
    entry: ZoneEntry | None,
    unmet: Iterable[ClearCondition] = (),
) -> LogEvent:
    """Log line for a new speed factor of a robot, with its cause.

    Args:
        report: The robot's report of the new factor.
        entry: Zone entry behind it, where known.
        unmet: Unmet conditions of "clear"; a pose keeps the sentence of its reason.
    """
    slots: dict[str, Slot] = {
        "robot": report.robot_id,
        "factor": report.speed_factor,
        "reason": report.reason,
        "cause": report.cause,
    }
    if report.speed_factor >= FULL_SPEED:
        return LogEvent("speed", "log.speed_up", slots, report.robot_id)
    key = f"log.speed_down.{report.reason}"
    reported = report.reason, report.cause
    matching = (
        item for item in unmet if (item.limit_reason, item.robot_id) == reported
    )
    condition = next(matching, None)
    if condition is not None and condition.reason != "pose":
        slots["observer"] = condition.robot_id
        key = f"log.speed_down.{condition.reason}"
        return LogEvent("speed", key, slots, report.robot_id)
    if entry is None or report.reason not in ("person", "robot"):
        return LogEvent("speed", key, slots, report.robot_id)
    zone, confidence = entry.zone, _confidence(entry.zone.sighting)
    if zone.reason == "person" and confidence is None:
        # No camera has seen this person: the zone is that of a laser track.
        key = "log.speed_down.walker"
    slots |= {
        "distance": round(entry.entered_m, 2),
        "observer": zone.observer,
        "person": zone.cause,
        "class": zone.reason,
        "confidence": confidence,
        "in_sight": entry.in_sight,
    }
    unseen_s = 0.0 if zone.sighting is None else zone.sighting.age_s(entry.entered)
    if unseen_s > LIMITS.growth_grace_s:
        # A zone has grown from this age on, so its radius explains the slow-down.
        slots |= {"radius": round(zone.radius_m, 2), "unseen": round(unseen_s, 1)}
    return LogEvent(
        "speed",
        key if entry.in_sight else f"{key}_nlos",
        slots,
        report.robot_id,
        zone.reason,
        entry.decision_id,
    )


def alert_line(step: str, alert: BookedAlert, **also: Slot) -> LogEvent:
    """Log line for a step of an alert: raised, cleared or acknowledged."""
    condition, key = alert.condition, alert.condition.key
    slots = {**condition.slots, "alert": key, "priority": alert.priority, **also}
    return LogEvent("alert", f"log.alert.{step}", slots, condition.robot_id)


def thing_line(key: str, thing: Thing, by: str) -> LogEvent:
    """Log line for a mark that was made, taken back or has expired."""
    place = {"x": round(thing.x, 2), "y": round(thing.y, 2)}
    return LogEvent("system", key, {"by": by, **place})
