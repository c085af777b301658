"""Keep when a program's token ends by itself."""

import sqlalchemy as sa
from alembic import op

revision = "end_api_tokens"
down_revision = "keep_pins"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("api_tokens", sa.Column("ends_at", sa.Double(), nullable=True))


def downgrade() -> None:
    op.drop_column("api_tokens", "ends_at")
