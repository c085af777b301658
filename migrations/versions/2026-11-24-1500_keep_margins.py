"""Keep the least margin of a robot with its pose and speed."""

import sqlalchemy as sa
from alembic import op

revision = "keep_margins"
down_revision = "keep_goals"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("odometry", sa.Column("margin_m", sa.Double(), nullable=True))


def downgrade() -> None:
    op.drop_column("odometry", "margin_m")
