"""Keep PINs by which people unlock a shared tablet, as hashes."""

import sqlalchemy as sa
from alembic import op

revision = "keep_pins"
down_revision = "keep_passkeys"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "accounts", sa.Column("pin", sa.Text(), nullable=False, server_default="")
    )


def downgrade() -> None:
    op.drop_column("accounts", "pin")
