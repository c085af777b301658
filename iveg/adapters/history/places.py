"""Where robots and people were in each second of a range."""

from sqlalchemy import Connection, func, select

from iveg.adapters.history.rounding import whole
from iveg.adapters.history.tables import detections, odometry
from iveg.domain.day import DaySighting, Pose


def poses_of(connection: Connection, since: float, until: float) -> tuple[Pose, ...]:
    """Poses of robots in each second of ``since <= at < until``, in order."""
    c = odometry.c
    second = whole(connection, c.at)
    wanted = (
        select(
            c.robot_id,
            second,
            func.avg(c.x),
            func.avg(c.y),
            func.avg(func.abs(c.linear)),
        )
        .where(c.at >= since, c.at < until)
        .group_by(c.robot_id, second)
        .order_by(second)
    )
    return tuple(Pose(*row) for row in connection.execute(wanted))


def people_seen(
    connection: Connection, since: float, until: float
) -> tuple[DaySighting, ...]:
    """Positions of confirmed people in each second of ``since <= at < until``."""
    c = detections.c
    second = whole(connection, c.at)
    wanted = (
        select(second, func.avg(c.x), func.avg(c.y), c.robot_id)
        .where(c.at >= since, c.at < until, c.confident, c.class_ == "person")
        # A place that is no longer kept is no place near a robot.
        .where(c.x.is_not(None))
        # Two people of one second must not become one between them.
        .group_by(c.robot_id, c.person_id, second)
        .order_by(second)
    )
    return tuple(DaySighting(*row) for row in connection.execute(wanted))
