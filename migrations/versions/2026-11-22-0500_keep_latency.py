"""Keep a day of latency, minute by minute."""

import sqlalchemy as sa
from alembic import op

revision = "keep_latency"
down_revision = "group_alerts"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "latency",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=False),
        sa.Column("data", sa.Text(), nullable=False),
        sa.Column("hop", sa.Text(), nullable=False),
        sa.Column("count", sa.BigInteger(), nullable=False),
        sa.Column("total_s", sa.Double(), nullable=False),
        sa.Column("least_s", sa.Double(), nullable=False),
        sa.Column("most_s", sa.Double(), nullable=False),
        sa.Column("bins", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("row_id", name="pk_latency"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_latency_at", "latency", ["at"])


def downgrade() -> None:
    op.drop_table("latency")
