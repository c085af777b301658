"""Keep passkeys of people: the public key, where it works, when each was used last."""

import sqlalchemy as sa
from alembic import op

revision = "keep_passkeys"
down_revision = "index_cost"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "passkeys",
        sa.Column("credential_id", sa.Text(), nullable=False),
        sa.Column("account_id", sa.Text(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("rp_id", sa.Text(), nullable=False),
        sa.Column("public_key", sa.Text(), nullable=False),
        sa.Column("sign_count", sa.BigInteger(), nullable=False),
        sa.Column("made_at", sa.Double(), nullable=False),
        sa.Column("used_at", sa.Double(), nullable=True),
        sa.PrimaryKeyConstraint("credential_id", name="pk_passkeys"),
    )


def downgrade() -> None:
    op.drop_table("passkeys")
