"""Call columns by the glossary: ``transport`` was road, ``limit_factor`` mandated."""

from collections.abc import Mapping

import sqlalchemy as sa
from alembic import op

revision = "name_transport_and_limit"
down_revision = "key_by_transport"
branch_labels = None
depends_on = None

_IDS = {"orion": "fiware", "mqtt": "direct"}


def upgrade() -> None:
    _rename("detections", "road", "transport")
    _rename("odometry", "mandated_factor", "limit_factor")
    _replace("transport", _IDS)


def downgrade() -> None:
    _replace("transport", {now: before for before, now in _IDS.items()})
    _rename("odometry", "limit_factor", "mandated_factor")
    _rename("detections", "transport", "road")


def _rename(table: str, before: str, now: str) -> None:
    """In place on both databases; a batch would copy the whole table on SQLite."""
    op.execute(f"ALTER TABLE {table} RENAME COLUMN {before} TO {now}")


def _replace(name: str, values: Mapping[str, str]) -> None:
    detections = sa.table("detections", sa.column(name))
    column = detections.c[name]
    now = sa.case(dict(values), value=column, else_=column)
    op.execute(sa.update(detections).values({name: now}))
