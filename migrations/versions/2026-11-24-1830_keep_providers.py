"""Keep which identity provider vouches for a person."""

import sqlalchemy as sa
from alembic import op

revision = "keep_providers"
down_revision = "keep_late"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "accounts",
        sa.Column("provider", sa.Text(), nullable=False, server_default=""),
    )


def downgrade() -> None:
    op.drop_column("accounts", "provider")
