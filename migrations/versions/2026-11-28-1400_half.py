"""Drop what the halved iVeg keeps no more, and note when accounts have moved out."""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "half"
down_revision = "part_days"
branch_labels = None
depends_on = None

_POSE = ["at", "robot_id", "x", "y", "linear"]
_COVERING = (
    (
        "ix_odometry_slowed",
        [*_POSE, "applied_factor"],
        "applied_factor > 0.0 AND applied_factor < 1.0 "
        "AND (linear >= 0.02 OR linear <= -0.02)",
    ),
    ("ix_odometry_near", [*_POSE, "margin_m"], "margin_m < 0.0"),
)
_SAYS = "the audit is append-only"
_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
_LATENCY_TEXTS = "robot_id", "data", "hop"
_LATENCY_NUMBERS = "total_s", "least_s", "most_s"


def upgrade() -> None:
    op.drop_table("passkeys")
    op.drop_table("latency")
    op.drop_column("alerts", "members")
    op.drop_column("accounts", "pin")
    for name, *_ in _COVERING:
        op.drop_index(name, "odometry")
    op.create_table("access_moved", sa.Column("at", sa.Double(), nullable=False))
    _unchain_audit()
    # Made afterwards of what a robot kept in a gap: no decision that anybody took.
    op.execute("DELETE FROM decisions WHERE kind = 'late'")
    for table in ("odometry", "detections"):
        op.drop_column(table, "late")
    op.drop_column("commands", "drill")


def downgrade() -> None:
    op.add_column(
        "commands",
        sa.Column("drill", sa.Boolean(), nullable=False, server_default=sa.false()),
    )
    for table in ("odometry", "detections"):
        late = sa.Column(
            "late", sa.Boolean(), nullable=False, server_default=sa.false()
        )
        op.add_column(table, late)
    _chain_audit()
    members = sa.JSON().with_variant(JSONB(), "postgresql")
    op.add_column(
        "alerts",
        sa.Column("members", members, nullable=False, server_default="[]"),
    )
    op.create_table(
        "latency",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        *(sa.Column(name, sa.Text(), nullable=False) for name in _LATENCY_TEXTS),
        sa.Column("count", sa.BigInteger(), nullable=False),
        *(sa.Column(name, sa.Double(), nullable=False) for name in _LATENCY_NUMBERS),
        sa.Column("bins", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("row_id", name="pk_latency"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_latency_at", "latency", ["at"])
    op.drop_table("access_moved")
    for name, columns, where in _COVERING:
        op.create_index(
            name,
            "odometry",
            columns,
            sqlite_where=sa.text(where),
            postgresql_where=sa.text(where),
        )
    op.add_column(
        "accounts", sa.Column("pin", sa.Text(), nullable=False, server_default="")
    )
    op.create_table(
        "passkeys",
        sa.Column("credential_id", sa.Text(), nullable=False),
        sa.Column("account_id", sa.Text(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("rp_id", sa.Text(), nullable=False),
        sa.Column("public_key", sa.Text(), nullable=False),
        sa.Column("sign_count", sa.BigInteger(), nullable=False),
        sa.Column("made_at", sa.Double(), nullable=False),
        sa.Column("used_at", sa.Double(), nullable=True),
        sa.PrimaryKeyConstraint("credential_id", name="pk_passkeys"),
    )


def _unchain_audit() -> None:
    """Drop the chain of the audit; changes and deletions stay refused."""
    is_sqlite = op.get_bind().dialect.name == "sqlite"
    _drop_guards(is_sqlite)
    op.drop_table("audit_end")
    op.drop_table("audit_sealed")
    for name in ("stored_at", "previous_hash", "hash"):
        op.drop_column("audit", name)
    for does in ("UPDATE", "DELETE"):
        _guard(is_sqlite, "audit", does)
    if is_sqlite:
        return
    op.execute("DROP FUNCTION refuse_kept_audit()")
    op.execute("CREATE SEQUENCE audit_seq_seq OWNED BY audit.seq")
    op.execute("SELECT setval('audit_seq_seq', max(seq) + 1, false) FROM audit")
    op.execute(
        "ALTER TABLE audit ALTER COLUMN seq SET DEFAULT nextval('audit_seq_seq')"
    )


def _chain_audit() -> None:
    """Bring the chain's columns back, without what they held."""
    is_sqlite = op.get_bind().dialect.name == "sqlite"
    _drop_guards(is_sqlite)
    op.add_column(
        "audit", sa.Column("stored_at", sa.Double(), nullable=False, server_default="0")
    )
    for name in ("previous_hash", "hash"):
        op.add_column(
            "audit", sa.Column(name, sa.Text(), nullable=False, server_default="")
        )
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
    # The chain goes on behind the rows that are there, which prove nothing.
    newest = "max(seq), '', 0 FROM audit HAVING max(seq) IS NOT NULL"
    op.execute(f"INSERT INTO audit_sealed (seq, hash, at) SELECT {newest}")
    op.execute(f"INSERT INTO audit_end (one, seq, hash, at) SELECT 1, {newest}")
    for table in ("audit", "audit_sealed"):
        for does in ("UPDATE", "DELETE"):
            _guard(is_sqlite, table, does)
    if not is_sqlite:
        op.execute("ALTER TABLE audit ALTER COLUMN seq DROP DEFAULT")
        op.execute("DROP SEQUENCE audit_seq_seq")
        # The revision below drops it with its tables.
        op.execute(
            "CREATE FUNCTION refuse_kept_audit() RETURNS trigger LANGUAGE plpgsql AS "
            "$$ BEGIN RETURN OLD; END $$"
        )


def _drop_guards(is_sqlite: bool) -> None:
    for name in ("audit_no_update", "audit_no_delete"):
        op.execute(f"DROP TRIGGER {name}" + ("" if is_sqlite else " ON audit"))


def _guard(is_sqlite: bool, table: str, does: str) -> None:
    trigger = f"CREATE TRIGGER {table}_no_{does.lower()} BEFORE {does} ON {table}"
    if is_sqlite:
        op.execute(f"{trigger} BEGIN SELECT RAISE(ABORT, '{_SAYS}'); END")
    else:
        op.execute(f"{trigger} FOR EACH ROW EXECUTE FUNCTION refuse_audit()")
