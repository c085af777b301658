"""Find what is to leave the history; a detection may lose its place."""

import sqlalchemy as sa
from alembic import op

revision = "retain"
down_revision = "name_transport_and_limit"
branch_labels = None
depends_on = None

_PLACED = (
    ("ix_detections_placed", "detections", "at", "x IS NOT NULL", "x IS NOT NULL"),
    (
        "ix_decisions_placed",
        "decisions",
        "started_at",
        "x IS NOT NULL",
        "x IS NOT NULL",
    ),
    ("ix_log_placed", "log", "at", "instr(slots, '\"x\":') > 0", "slots ? 'x'"),
)


def upgrade() -> None:
    _let_place_be_null(nullable=True)
    op.create_index("ix_command_events_at", "command_events", ["at"])
    for name, table, column, sqlite, postgresql in _PLACED:
        op.create_index(
            name,
            table,
            [column],
            sqlite_where=sa.text(sqlite),
            postgresql_where=sa.text(postgresql),
        )


def downgrade() -> None:
    for name, table, *_ in reversed(_PLACED):
        op.drop_index(name, table)
    op.drop_index("ix_command_events_at", "command_events")
    # The version before cannot hold a detection without its place.
    op.execute("DELETE FROM detections WHERE x IS NULL")
    _let_place_be_null(nullable=False)


def _let_place_be_null(*, nullable: bool) -> None:
    """SQLite copies the table for it, which PostgreSQL does not."""
    with op.batch_alter_table(
        "detections", table_kwargs={"sqlite_autoincrement": True}
    ) as batch:
        for name in ("x", "y", "z"):
            batch.alter_column(name, existing_type=sa.Double(), nullable=nullable)
