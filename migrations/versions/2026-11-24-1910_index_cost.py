"""Find slowed and near poses of a range without reading all of them."""

import sqlalchemy as sa
from alembic import op

revision = "index_cost"
down_revision = "keep_language"
branch_labels = None
depends_on = None

_COVERING = (
    (
        "ix_odometry_slowed",
        ["at", "robot_id", "x", "y", "linear", "applied_factor"],
        "applied_factor > 0.0 AND applied_factor < 1.0 "
        "AND (linear >= 0.02 OR linear <= -0.02)",
    ),
    (
        "ix_odometry_near",
        ["at", "robot_id", "x", "y", "linear", "margin_m"],
        "margin_m < 0.0",
    ),
)


def upgrade() -> None:
    for name, columns, where in _COVERING:
        op.create_index(
            name,
            "odometry",
            columns,
            sqlite_where=sa.text(where),
            postgresql_where=sa.text(where),
        )


def downgrade() -> None:
    for name, *_ in reversed(_COVERING):
        op.drop_index(name, "odometry")
