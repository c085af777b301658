"""Keep what small sensors say."""

import sqlalchemy as sa
from alembic import op

revision = "keep_readings"
down_revision = "keep_latency"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
# SQLite has no type of its own for JSON.
_JSON = sa.JSON().with_variant(sa.Text(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "readings",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("value", _JSON, nullable=False),
        sa.PrimaryKeyConstraint("row_id", name="pk_readings"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_readings_at_row_id", "readings", ["at", "row_id"])
    op.create_index("ix_readings_robot_id_at", "readings", ["robot_id", "at"])


def downgrade() -> None:
    op.drop_table("readings")
