"""What the history keeps of the rule's inputs, and what the rule decided."""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, and_, false, or_, select

from iveg.adapters.history.tables import decisions, detections, odometry
from iveg.domain.what_if.inputs import PoseRow, SeenRow
from iveg.domain.what_if.outcome import Decided


@dataclass(frozen=True, slots=True)
class RuleInputs:
    """Of a range, in order of time; of robots that were there, recordings too."""

    poses: Sequence[PoseRow]
    seen: Sequence[SeenRow]
    decided: Sequence[Decided]


def rule_inputs(connection: Connection, since: float, until: float) -> RuleInputs:
    """Everything of a range that judgements rest on (Unix s)."""
    o, d, c = odometry.c, detections.c, decisions.c
    poses = (
        select(o.robot_id, o.at, o.x, o.y, o.yaw, o.linear, o.angular)
        .where(o.at >= since, o.at < until, o.late == false())
        .order_by(o.at)
    )
    # A robot without a track is one of the fleet, whose own odometry counts.
    somebody = or_(
        d.class_ == "person", and_(d.class_ == "robot", d.person_id.is_not(None))
    )
    seen = (
        select(
            d.robot_id,
            d.at,
            d.x,
            d.y,
            d.probability,
            d.class_,
            d.person_id,
            d.confident,
        )
        .where(d.at >= since, d.at < until, d.late == false(), d.x.is_not(None))
        .where(somebody)
        .order_by(d.at)
    )
    decided = select(c.robot_id, c.reason, c.started_at, c.ended_at).where(
        c.kind == "mandate",
        c.started_at < until,
        or_(c.ended_at.is_(None), c.ended_at >= since),
        # An index finds those: no slow-down lasts for so long.
        c.started_at >= since - 86_400.0,
    )
    return RuleInputs(
        *(
            [tuple(row) for row in connection.execute(asked)]
            for asked in (poses, seen, decided)
        )
    )
