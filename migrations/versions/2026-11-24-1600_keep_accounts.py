"""Keep who may sign in: names, roles, hashes of passwords and of invitations."""

import sqlalchemy as sa
from alembic import op

revision = "keep_accounts"
down_revision = "keep_audit"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "accounts",
        sa.Column("account_id", sa.Text(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("name_key", sa.Text(), nullable=False),
        sa.Column("role", sa.Text(), nullable=False),
        sa.Column("password", sa.Text(), nullable=False),
        sa.Column("disabled", sa.Boolean(), nullable=False),
        sa.Column("ends_at", sa.Double(), nullable=True),
        sa.Column("invitation", sa.Text(), nullable=False),
        sa.Column("invited_until", sa.Double(), nullable=False),
        sa.Column("since", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("account_id", name="pk_accounts"),
        sa.UniqueConstraint("name_key", name="uq_accounts_name_key"),
    )


def downgrade() -> None:
    op.drop_table("accounts")
