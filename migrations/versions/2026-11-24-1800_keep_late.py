"""Mark poses and detections that a robot sent after a gap."""

import sqlalchemy as sa
from alembic import op

revision = "keep_late"
down_revision = "keep_api_tokens"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for table in ("odometry", "detections"):
        op.add_column(
            table,
            sa.Column("late", sa.Boolean(), nullable=False, server_default=sa.false()),
        )


def downgrade() -> None:
    for table in ("odometry", "detections"):
        op.drop_column(table, "late")
