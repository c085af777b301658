"""A decision as it is recorded: each link with time, value and verdict."""

from collections.abc import Iterator
from dataclasses import asdict, replace

from iveg.domain.decisions import Link, Place, SlowdownDecision
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.parameters import for_class
from iveg.domain.records import DecisionRecord
from iveg.domain.rule.zones import Zone, ZoneEntry
from iveg.domain.stamps import wall_of
from iveg.domain.tracking.looks import Looks
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
    del document["confirmed"], document["lent"]
    return document


def write_link(link: Link) -> dict[str, object]:
    """A link as it is stored."""
    return {
        "link": link.name,
        "at": link.at,
        "value": link.value,
        "verdict": link.verdict,
    }
