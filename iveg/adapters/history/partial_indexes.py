"""Indexes of a few rows of large tables.

A query finds one by its condition, word for word.
"""

from typing import Any

from sqlalchemy import Column, Index, text

from iveg.adapters.history.tables import decisions, detections, log, metadata, odometry

__all__ = ["IS_NEAR", "IS_SLOWED", "metadata"]

IS_SLOWED = (
    "applied_factor > 0.0 AND applied_factor < 1.0 "
    "AND (linear >= 0.02 OR linear <= -0.02)"
)
"""A pose of a robot that drives under a limit."""
IS_NEAR = "margin_m < 0.0"
"""A pose from which a robot could not stop in time."""


def _partial(
    name: str,
    columns: tuple[Column[Any], ...],
    sqlite: str,
    postgresql: str | None = None,
) -> Index:
    return Index(
        name,
        *columns,
        sqlite_where=text(sqlite),
        postgresql_where=text(postgresql or sqlite),
    )


# Rows that have a place still, by which they are found to lose it.
placed_detections = _partial(
    "ix_detections_placed", (detections.c.at,), "x IS NOT NULL"
)
placed_decisions = _partial(
    "ix_decisions_placed", (decisions.c.started_at,), "x IS NOT NULL"
)
placed_lines = _partial(
    "ix_log_placed", (log.c.at,), "instr(slots, '\"x\":') > 0", "slots ? 'x'"
)

# These hold all that is asked of their poses.
_o = odometry.c
_POSE = _o.at, _o.robot_id, _o.x, _o.y, _o.linear
slowed_poses = _partial("ix_odometry_slowed", (*_POSE, _o.applied_factor), IS_SLOWED)
near_poses = _partial("ix_odometry_near", (*_POSE, _o.margin_m), IS_NEAR)
