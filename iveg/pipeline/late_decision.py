"""What the rule would have decided during a gap, made of what the robot kept.

A record of its own kind, ``late``: nobody acts on it, and no sum of decisions has it.
It tells of the robot that kept the pictures and of whom it saw itself; where others
were in the gap is not asked.  It lasts from the first to the last picture that has
somebody inside the ring, and ends where none had for two seconds.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b
from math import hypot

from iveg.domain.decisions import Link
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Origin
from iveg.domain.records import DecisionRecord, DetectionRecord
from iveg.pipeline.evidence import write_link

APART_S = 2.0
PERSON = "person"
"""Peers are no case of it: they were heard, and slowed for what was known of it."""


@dataclass(slots=True)
class LateDecisions:
    """Of one robot; pictures come in the order in which they were taken."""

    newest: DecisionRecord | None = None

    def judge(
        self,
        seen: Sequence[DetectionRecord],
        pose: Pose2D | None,
        applied: float | None,
        rule: DetectionRule,
        origin: Origin,
    ) -> Iterator[DecisionRecord]:
        """What a picture makes of it; nothing where nobody is inside the ring.

        Args:
            seen: What the picture had, in ``map``.
            pose: Of the robot then; None: unknown.
            applied: Its newest factor; None: unknown.
            rule: In force now: the one of the gap, where nobody changed it since.
            origin: Of the picture.
        """
        near = None if pose is None else _nearest(seen, pose, rule)
        if near is None:
            return
        one, distance_m = near
        if self.newest is None or not _lasts(self.newest, one):
            self.newest = _begin(one, distance_m, applied, rule, origin)
        self.newest = replace(self.newest, ended_at=one.at)
        yield self.newest


def _nearest(
    seen: Sequence[DetectionRecord], pose: Pose2D, rule: DetectionRule
) -> tuple[DetectionRecord, float] | None:
    """Who is nearest of those inside the ring, and how far it is (m)."""
    found = [
        (one, hypot(one.x - pose.x, one.y - pose.y))
        for one in seen
        if one.class_ == PERSON
        and one.confident
        and one.x is not None
        and one.y is not None
    ]
    inside = [one for one in found if one[1] <= rule.radius_m]
    return min(inside, key=lambda one: one[1], default=None)


def _lasts(known: DecisionRecord, one: DetectionRecord) -> bool:
    ended_at = known.ended_at or known.started_at
    return 0.0 <= one.at - ended_at <= APART_S


def _begin(
    one: DetectionRecord,
    distance_m: float,
    applied: float | None,
    rule: DetectionRule,
    origin: Origin,
) -> DecisionRecord:
    # By what it was made of, so that the same batch makes no second one.
    named = f"{one.robot_id} {origin.boot} {origin.seq}".encode()
    links = (
        Link("detection", "ok", one.at, one.class_id),
        Link("filter", "ok", one.at, one.probability),
        Link("geometry", "ok", one.at, distance_m),
        Link("rule", "ok", one.at, f"{rule.id} {rule.version}"),
        Link("feedback", "n/a"),
        _applied(applied, one.at),
        Link("observed", "n/a"),
    )
    return DecisionRecord(
        decision_id=f"late-{blake2b(named, digest_size=10).hexdigest()}",
        kind="late",
        robot_id=one.robot_id,
        started_at=one.at,
        observer=one.robot_id,
        class_=one.class_,
        class_id=one.class_id,
        confidence=one.probability,
        x=one.x,
        y=one.y,
        z=one.z,
        distance_m=distance_m,
        speed_factor=HALF_SPEED,
        reason=one.class_,
        rule_id=rule.id,
        rule_version=str(rule.version),
        rule_parameters={
            "threshold": rule.threshold_of(rule.class_of(one.class_id)),
            "radius_m": rule.radius_m,
            "ring_m": rule.radius_m,
            "author": rule.author,
        },
        in_sight=True,
        links=[write_link(link) for link in links],
    )


def _applied(factor: float | None, at: float) -> Link:
    """What the robot applied by itself: nobody could tell it anything."""
    if factor is None:
        return Link("applied", "unknown")
    return Link("applied", "ok" if factor <= HALF_SPEED else "missing", at, factor)
