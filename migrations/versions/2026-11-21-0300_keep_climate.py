"""Keep the air in the greenhouse."""

import sqlalchemy as sa
from alembic import op

revision = "keep_climate"
down_revision = "time_presses"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "climate",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("temperature", sa.Double(), nullable=True),
        sa.Column("relative_humidity", sa.Double(), nullable=True),
        sa.Column("co2", sa.Double(), nullable=True),
        sa.PrimaryKeyConstraint("row_id", name="pk_climate"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_climate_at", "climate", ["at"])


def downgrade() -> None:
    op.drop_table("climate")
