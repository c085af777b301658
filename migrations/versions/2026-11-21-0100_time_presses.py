"""Keep when a STOP was pressed, and whether it was a drill."""

import sqlalchemy as sa
from alembic import op

revision = "time_presses"
down_revision = "create_history"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("commands", sa.Column("pressed_at", sa.Double(), nullable=True))
    op.add_column(
        "commands",
        sa.Column("drill", sa.Boolean(), nullable=False, server_default=sa.false()),
    )


def downgrade() -> None:
    op.drop_column("commands", "drill")
    op.drop_column("commands", "pressed_at")
