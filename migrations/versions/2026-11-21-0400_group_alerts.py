"""Keep the newest time of an alert that repeats, and its members."""

import sqlalchemy as sa
from alembic import op

revision = "group_alerts"
down_revision = "keep_climate"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("alerts") as alerts:
        alerts.add_column(sa.Column("last_raised_at", sa.Double(), nullable=True))
        alerts.add_column(
            sa.Column("members", sa.Text(), nullable=False, server_default="[]")
        )
    op.execute("UPDATE alerts SET last_raised_at = raised_at")
    with op.batch_alter_table("alerts") as alerts:
        alerts.alter_column("last_raised_at", nullable=False)
        alerts.alter_column("members", server_default=None)
        alerts.drop_index("ix_alerts_raised_at_alert_id")
        alerts.create_index(
            "ix_alerts_last_raised_at_alert_id", ["last_raised_at", "alert_id"]
        )


def downgrade() -> None:
    with op.batch_alter_table("alerts") as alerts:
        alerts.drop_index("ix_alerts_last_raised_at_alert_id")
        alerts.create_index("ix_alerts_raised_at_alert_id", ["raised_at", "alert_id"])
        alerts.drop_column("members")
        alerts.drop_column("last_raised_at")
