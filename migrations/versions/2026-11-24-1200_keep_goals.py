"""Keep goals among the commands: where a robot was sent."""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "keep_goals"
down_revision = "keep_measurements"
branch_labels = None
depends_on = None


def upgrade() -> None:
    kind = sa.Text().with_variant(JSONB(), "postgresql")
    op.add_column("commands", sa.Column("goal", kind, nullable=True))


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM commands WHERE kind = 'goal'"))
    op.drop_column("commands", "goal")
