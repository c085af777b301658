"""A decision as it is recorded: each link with time, value and verdict."""

from collections.abc import Iterator
from dataclasses import asdict, replace

from iveg.domain.decisions import Link, Place, SlowdownDecision
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.obstacle import Obstacle
from iveg.domain.records import DecisionRecord
from iveg.domain.rule.crossings import Crossing
from iveg.domain.rule.zones import Zone
from iveg.domain.stamps import wall_of
from iveg.domain.tracking.looks import Looks
from iveg.domain.world import World


def record_of(decision: SlowdownDecision) -> DecisionRecord:
    """The whole chain as it stands; open links may yet come."""
    crossing = decision.crossing
    zone, sighting = crossing.zone, crossing.zone.sighting
    return DecisionRecord(
        decision_id=decision.decision_id,
        kind="mandate",
        robot_id=crossing.robot_id,
        started_at=crossing.entered.wall,
        person_id=None if zone.obstacle is not None else zone.cause,
        observer=zone.observer,
        class_=zone.reason,
        class_id=None if sighting is None else sighting.class_id,
        confidence=None if sighting is None or sighting.laser else sighting.confidence,
        x=zone.x,
        y=zone.y,
        z=None if sighting is None else sighting.z,
        distance_m=crossing.entered_m,
        speed_factor=HALF_SPEED,
        reason=zone.reason,
        rule_id=decision.rule.id,
        rule_version=str(decision.rule.version),
        rule_parameters={
            **_parameters(decision.rule, zone),
            "foretold_s": crossing.foretold_s,
            "obstacle": _obstacle(zone.obstacle, crossing.entered.mono),
            "places": [asdict(one) for one in decision.places],
        },
        in_sight=crossing.in_sight,
        feedback_at=wall_of(decision.feedback),
        applied_at=wall_of(decision.applied),
        observed_at=wall_of(decision.observed),
        ended_at=wall_of(decision.ended),
        speed_before=crossing.speed_before,
        speed_after=decision.speed_after,
        links=[write_link(link) for link in decision.links()],
    )


def places_of(crossing: Crossing, world: World) -> Iterator[Place]:
    """Places of the slowed robot and the observer now, where they are known."""
    for robot_id in dict.fromkeys((crossing.robot_id, crossing.zone.observer)):
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
        "threshold": None
        if zone.reason == "obstacle"
        else rule.threshold_of(zone.reason),
        "radius_m": rule.radius_m,
        "ring_m": round(zone.radius_m, 3),
        "author": rule.author,
        "possible": sighting is not None and (sighting.possible or sighting.laser),
        "looks": None if looks is None else _looks(looks),
    }


def _obstacle(seen: Obstacle | None, at: float) -> dict[str, object] | None:
    """What a laser saw, and for how long by ``at`` (monotonic, s)."""
    if seen is None:
        return None
    return {
        "size_m": round(seen.size_m, 2),
        "gap_m": round(seen.gap_m, 2),
        "moved": seen.has_moved,
        "over_s": round(max(0.0, at - seen.since), 1),
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
