"""Keep who did what, in a chain that nobody changes or shortens unnoticed."""

import sqlalchemy as sa
from alembic import op

revision = "keep_audit"
down_revision = "keep_margins"
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
_TEXTS = ("person", "name", "role", "method", "action", "subject", "details")
_HASHES = ("previous_hash", "hash")
_SEALED = "OLD.seq > coalesce((SELECT max(seq) FROM audit_sealed), 0)"
_SAYS = "the audit is append-only"


def upgrade() -> None:
    op.create_table(
        "audit",
        sa.Column("seq", _BIG, autoincrement=False, nullable=False),
        sa.Column("audit_id", sa.Text(), nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("stored_at", sa.Double(), nullable=False),
        *(sa.Column(name, sa.Text(), nullable=False) for name in _TEXTS + _HASHES),
        sa.PrimaryKeyConstraint("seq", name="pk_audit"),
        sa.UniqueConstraint("audit_id", name="uq_audit_audit_id"),
    )
    op.create_index("ix_audit_at_seq", "audit", ["at", "seq"])
    op.create_table(
        "audit_sealed",
        sa.Column("seq", _BIG, autoincrement=False, nullable=False),
        sa.Column("hash", sa.Text(), nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("seq", name="pk_audit_sealed"),
    )
    op.create_table(
        "audit_end",
        sa.Column("one", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("seq", sa.BigInteger(), nullable=False),
        sa.Column("hash", sa.Text(), nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("one", name="pk_audit_end"),
    )
    if op.get_bind().dialect.name == "sqlite":
        _guard_sqlite()
    else:
        _guard_postgresql()


def downgrade() -> None:
    # Triggers go with their tables.
    for table in ("audit_end", "audit", "audit_sealed"):
        op.drop_table(table)
    if op.get_bind().dialect.name != "sqlite":
        op.execute("DROP FUNCTION refuse_audit(), refuse_kept_audit()")


def _guard_sqlite() -> None:
    refuse = f"BEGIN SELECT RAISE(ABORT, '{_SAYS}'); END"
    for table, does, when in _refused():
        name = f"{table}_no_{does.lower()}"
        op.execute(f"CREATE TRIGGER {name} BEFORE {does} ON {table} {when} {refuse}")


def _guard_postgresql() -> None:
    op.execute(
        "CREATE FUNCTION refuse_audit() RETURNS trigger LANGUAGE plpgsql AS "
        f"$$ BEGIN RAISE EXCEPTION '{_SAYS}'; END $$"
    )
    # A trigger's condition holds no question here, so the function asks it.
    op.execute(
        "CREATE FUNCTION refuse_kept_audit() RETURNS trigger LANGUAGE plpgsql AS "
        f"$$ BEGIN IF {_SEALED} THEN RAISE EXCEPTION '{_SAYS}'; END IF; "
        "RETURN OLD; END $$"
    )
    for table, does, when in _refused():
        function = "refuse_kept_audit" if when else "refuse_audit"
        op.execute(
            f"CREATE TRIGGER {table}_no_{does.lower()} BEFORE {does} ON {table} "
            f"FOR EACH ROW EXECUTE FUNCTION {function}()"
        )
    for table in ("audit", "audit_sealed"):
        op.execute(
            f"CREATE TRIGGER {table}_no_truncate BEFORE TRUNCATE ON {table} "
            "FOR EACH STATEMENT EXECUTE FUNCTION refuse_audit()"
        )


def _refused():
    yield "audit", "UPDATE", ""
    yield "audit", "DELETE", f"WHEN {_SEALED}"
    yield "audit_sealed", "UPDATE", ""
    yield "audit_sealed", "DELETE", ""
