"""Keep the language that a person with an account reads."""

import sqlalchemy as sa
from alembic import op

revision = "keep_language"
down_revision = "keep_providers"
branch_labels = None
depends_on = None


def upgrade() -> None:
    column = sa.Column("language", sa.Text(), nullable=False, server_default="")
    op.add_column("accounts", column)


def downgrade() -> None:
    op.drop_column("accounts", "language")
