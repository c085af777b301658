"""Key the times of an order by transport: a third one needs no column."""

from collections.abc import Mapping

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "key_by_transport"
down_revision = "hold_json"
branch_labels = None
depends_on = None

_OLD = {
    "sent_at": {"fiware": "sent_fiware_at", "direct": "sent_direct_at"},
    "answer_at": {"fiware": "answer_fiware_at", "direct": "answer_direct_at"},
}
_JSON = sa.Text().with_variant(JSONB(), "postgresql")
_VALUES = sa.JSON().with_variant(JSONB(), "postgresql")
"""SQLite's JSON is text, and SQLAlchemy reads and writes values."""
_OLD_NAMES = [name for names in _OLD.values() for name in names.values()]
_commands = sa.table(
    "commands",
    sa.column("command_id"),
    *(sa.column(name, _VALUES) for name in _OLD),
    *(sa.column(name) for name in _OLD_NAMES),
)


def upgrade() -> None:
    with op.batch_alter_table("commands") as commands:
        for name in _OLD:
            empty = sa.Column(name, _JSON, nullable=False, server_default="{}")
            commands.add_column(empty)
    _write_each(_OLD_NAMES, _by_transport)
    with op.batch_alter_table("commands") as commands:
        for name in _OLD:
            commands.alter_column(name, server_default=None)
        for name in _OLD_NAMES:
            commands.drop_column(name)


def downgrade() -> None:
    with op.batch_alter_table("commands") as commands:
        for name in _OLD_NAMES:
            commands.add_column(sa.Column(name, sa.Double(), nullable=True))
    _write_each(list(_OLD), _by_column)
    with op.batch_alter_table("commands") as commands:
        for name in _OLD:
            commands.drop_column(name)


def _write_each(names: list[str], as_wanted) -> None:
    database = op.get_bind()
    key = _commands.c.command_id
    rows = database.execute(sa.select(key, *(_commands.c[name] for name in names)))
    for row in rows.mappings().all():
        wanted = as_wanted(row)
        change = sa.update(_commands).where(key == row["command_id"])
        database.execute(change.values(wanted))


def _by_transport(row: Mapping) -> dict[str, dict[str, float]]:
    return {
        name: {one: row[old] for one, old in olds.items() if row[old] is not None}
        for name, olds in _OLD.items()
    }


def _by_column(row: Mapping) -> dict[str, float | None]:
    return {
        old: (row[name] or {}).get(one)
        for name, olds in _OLD.items()
        for one, old in olds.items()
    }
