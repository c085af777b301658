"""Give each day of telemetry a table of its own on PostgreSQL, and charts their index.

Rows that are there stay where they are: their table becomes the part of all days before
the first that has its own.
"""

from datetime import UTC, datetime

import sqlalchemy as sa
from alembic import op

revision = "part_days"
down_revision = "end_api_tokens"
branch_labels = None
depends_on = None

_TABLES = "odometry", "detections"
_TODAY = "floor(extract(epoch FROM now()) / 86400)::bigint"
_CHARTED = {
    "odometry": "linear, limit_factor, applied_factor, margin_m",
    "detections": "class_id, probability",
}
"""What a chart of a robot's day asks of its rows, of which each page holds a few."""


def upgrade() -> None:
    if op.get_bind().dialect.name != "postgresql":
        return
    for table, charted in _CHARTED.items():
        op.execute(f"DROP INDEX ix_{table}_robot_id_at")
        op.execute(
            f"CREATE INDEX ix_{table}_robot_id_at ON {table} (robot_id, at) "
            f"INCLUDE ({charted})"
        )
        _part(table)


def _part(table: str) -> None:
    database = op.get_bind()
    op.execute(f"LOCK TABLE {table}")
    today = database.scalar(sa.text(f"SELECT {_TODAY}"))
    of_today = sa.text(
        f"SELECT count(*) FROM (SELECT 1 FROM {table} WHERE at >= {today * 86400} "
        f"AND at < {(today + 1) * 86400} LIMIT 1) AS found"
    )
    start = today + database.scalar(of_today)
    past = f"{table}_before_{datetime.fromtimestamp(start * 86400, UTC):%Y%m%d}"
    op.execute(f"ALTER TABLE {table} DROP CONSTRAINT pk_{table}")
    definitions = _indexes(table)
    for name in definitions:
        op.execute(f"ALTER INDEX {name} RENAME TO {name}_before")
    op.execute(f"ALTER TABLE {table} RENAME TO {past}")
    op.execute(
        f"CREATE TABLE {table} (LIKE {past} INCLUDING DEFAULTS) PARTITION BY RANGE (at)"
    )
    op.execute(f"ALTER SEQUENCE {table}_row_id_seq OWNED BY {table}.row_id")
    for definition in definitions.values():
        op.execute(definition)
    op.execute(f"CREATE TABLE {table}_rest PARTITION OF {table} DEFAULT")
    op.execute(
        f"WITH moved AS (DELETE FROM {past} WHERE at >= {start * 86400} RETURNING *) "
        f"INSERT INTO {table}_rest SELECT * FROM moved"
    )
    # Indexes of the same definition become parts of those above.
    op.execute(
        f"ALTER TABLE {table} ATTACH PARTITION {past} "
        f"FOR VALUES FROM (MINVALUE) TO ({start * 86400})"
    )


def downgrade() -> None:
    if op.get_bind().dialect.name != "postgresql":
        return
    for table in _TABLES:
        definitions = _indexes(table)
        op.execute(f"CREATE TABLE {table}_whole (LIKE {table} INCLUDING DEFAULTS)")
        op.execute(f"INSERT INTO {table}_whole SELECT * FROM {table}")
        op.execute(f"ALTER SEQUENCE {table}_row_id_seq OWNED BY {table}_whole.row_id")
        op.execute(f"DROP TABLE {table}")
        op.execute(f"ALTER TABLE {table}_whole RENAME TO {table}")
        op.execute(
            f"ALTER TABLE {table} ADD CONSTRAINT pk_{table} PRIMARY KEY (row_id)"
        )
        for definition in definitions.values():
            op.execute(definition.replace(" ON ONLY ", " ON "))
        op.execute(f"DROP INDEX ix_{table}_robot_id_at")
        op.execute(f"CREATE INDEX ix_{table}_robot_id_at ON {table} (robot_id, at)")


def _indexes(table: str) -> dict[str, str]:
    """Name → what makes it."""
    found = op.get_bind().execute(
        sa.text(
            "SELECT indexname, indexdef FROM pg_indexes "
            "WHERE tablename = :name AND schemaname = current_schema()"
        ),
        {"name": table},
    )
    return {row.indexname: row.indexdef for row in found}
