"""What the history still holds: days, its oldest rows, and what of a day is gone."""

from typing import Literal

from sqlalchemy import Connection, and_, exists, func, select

from iveg.adapters.history.tables import (
    decisions,
    detections,
    log,
    metadata,
    odometry,
)
from iveg.domain.retention import DAY_S, PURGE_STEPS


def lost_of(
    connection: Connection, since: float, until: float
) -> tuple[Literal["places", "telemetry"], ...]:
    """What is no longer kept of ``since <= at < until``, or of a part of it."""
    d, s = detections.c, decisions.c
    decided = and_(s.started_at >= since, s.started_at < until)
    # A decision was about somebody, and its robot drove.
    unplaced = select(exists().where(decided, s.x.is_(None)))
    unplaced_look = select(exists().where(d.at >= since, d.at < until, d.x.is_(None)))
    driven = connection.scalar(select(func.min(odometry.c.at)))
    lost: list[Literal["places", "telemetry"]] = []
    if any(connection.scalar(one) for one in (unplaced, unplaced_look)):
        lost.append("places")
    if driven is not None:
        unknown = select(exists().where(decided, s.started_at < driven))
        if driven >= until or connection.scalar(unknown):
            lost.append("telemetry")
    return tuple(lost)


def recorded_days(connection: Connection, most: int) -> tuple[int, ...]:
    """Days (UTC, since 1970) with a line in the log, newest first, by hops."""
    days: list[int] = []
    newest = select(func.max(log.c.at))
    while len(days) < most:
        if days:
            newest = select(func.max(log.c.at)).where(log.c.at < days[-1] * DAY_S)
        found = connection.scalar(newest)
        if found is None:
            break
        days.append(int(found // DAY_S))
    return tuple(days)


def oldest_telemetry(connection: Connection) -> float | None:
    """The oldest row of telemetry (Unix s); None where there is none."""
    names = (step.table for step in PURGE_STEPS if step.kind == "telemetry")
    oldest = (
        connection.scalar(select(func.min(metadata.tables[name].c.at)))
        for name in names
    )
    return min((at for at in oldest if at is not None), default=None)
