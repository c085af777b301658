"""Detections of a range by class and confidence."""

from dataclasses import dataclass

from sqlalchemy import Connection, func, select

from iveg.adapters.history.rounding import whole
from iveg.adapters.history.tables import detections

CONFIDENCE_BINS = 20


@dataclass(frozen=True, slots=True)
class ConfidenceCount:
    """Number of detections of a class in one interval of confidence.

    Attributes:
        class_id: As the detector said.
        least: Lower edge, inclusive; the slice is 1 / ``CONFIDENCE_BINS`` wide.
    """

    class_id: str
    least: float
    count: int


def confidence_counts(
    connection: Connection, since: float, until: float, robot: str | None = None
) -> tuple[ConfidenceCount, ...]:
    """Detections of ``since <= at < until`` by class and confidence."""
    bins = detections.c.probability * CONFIDENCE_BINS
    place = whole(connection, bins).label("place")
    statement = (
        select(detections.c.class_id, place, func.count())
        .where(detections.c.at >= since, detections.c.at < until)
        .group_by(detections.c.class_id, place)
    )
    if robot is not None:
        statement = statement.where(detections.c.robot_id == robot)
    counts: dict[tuple[str, int], int] = {}
    for class_id, number, count in connection.execute(statement):
        # Certainty itself, 1.0, belongs to the uppermost slice.
        slot = (class_id, min(int(number), CONFIDENCE_BINS - 1))
        counts[slot] = counts.get(slot, 0) + count
    return tuple(
        ConfidenceCount(class_id, slot / CONFIDENCE_BINS, count)
        for (class_id, slot), count in sorted(counts.items())
    )
