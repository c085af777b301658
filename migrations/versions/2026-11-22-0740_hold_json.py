"""Hold JSON as JSON, not as a text that holds it.

SQLite keeps JSON as its text, so its rows are already what they should be.  A text that
is no JSON (a damaged row, a number that is none) becomes null: one bad row must not
keep a history from its next version.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "hold_json"
down_revision = "keep_readings"
branch_labels = None
depends_on = None

_TEXTS = (
    ("alerts", "members"),
    ("alerts", "slots"),
    ("decisions", "links"),
    ("decisions", "rule_parameters"),
    ("detections", "box"),
    ("log", "slots"),
)
_READ = """
CREATE FUNCTION pg_temp.json_of(told text) RETURNS jsonb LANGUAGE plpgsql IMMUTABLE
AS $$
BEGIN
    RETURN told::jsonb;
EXCEPTION WHEN data_exception THEN
    RETURN 'null'::jsonb;
END $$
"""


def upgrade() -> None:
    if op.get_bind().dialect.name == "sqlite":
        return
    op.execute(_READ)
    for table, column in _TEXTS:
        using = f"pg_temp.json_of({column})"
        op.alter_column(table, column, type_=JSONB(), postgresql_using=using)
    op.alter_column("readings", "value", type_=JSONB(), postgresql_using="value::jsonb")


def downgrade() -> None:
    if op.get_bind().dialect.name == "sqlite":
        return
    for table, column in _TEXTS:
        using = f"{column}::text"
        op.alter_column(table, column, type_=sa.Text(), postgresql_using=using)
    op.alter_column(
        "readings", "value", type_=sa.JSON(), postgresql_using="value::json"
    )
