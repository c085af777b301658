"""Keep the numbers of other equipment."""

import sqlalchemy as sa
from alembic import op

revision = "keep_measurements"
down_revision = "retain"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "measurements",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("entity_id", sa.Text(), nullable=False),
        sa.Column("attribute", sa.Text(), nullable=False),
        sa.Column("value", sa.Double(), nullable=False),
        sa.Column("unit", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("row_id", name="pk_measurements"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_measurements_at_row_id", "measurements", ["at", "row_id"])
    op.create_index(
        "ix_measurements_entity_id_attribute_at",
        "measurements",
        ["entity_id", "attribute", "at"],
    )


def downgrade() -> None:
    op.drop_table("measurements")
