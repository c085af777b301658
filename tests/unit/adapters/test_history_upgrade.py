"""A history that the version before wrote keeps its rows when this one opens it.

``tests/data/part_days.sql`` is the dump of one, made by that version's own code.
"""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from iveg.adapters.history.engine import sqlite_url, upgrade
from tests.databases import remember
from tests.fakes.records import NOON, audit_record

DUMP = Path(__file__).parents[2] / "data" / "part_days.sql"
DROPPED = {"passkeys", "latency", "audit_sealed", "audit_end"}
DROPPED_COLUMNS = {
    ("accounts", "pin"),
    ("audit", "stored_at"),
    ("audit", "previous_hash"),
    ("audit", "hash"),
    ("commands", "drill"),
    ("alerts", "members"),
    ("odometry", "late"),
    ("detections", "late"),
}
Tables = dict[str, list[dict[str, object]]]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    file = tmp_path / "iveg.sqlite"
    with closing(sqlite3.connect(file)) as old:
        old.executescript(DUMP.read_text())
    return file


def content(file: Path) -> tuple[Tables, set[tuple[str, str]]]:
    """Rows of each table, and (table, column) of all columns."""
    with closing(sqlite3.connect(file)) as connection:
        connection.row_factory = sqlite3.Row
        named = connection.execute(
            "SELECT name FROM sqlite_master WHERE type = 'table' "
            "AND name NOT IN ('alembic_version', 'sqlite_sequence')"
        )
        rows, columns = {}, set()
        for (table,) in named.fetchall():
            found = connection.execute(f"SELECT * FROM {table}")  # noqa: S608
            columns |= {(table, one[0]) for one in found.description}
            rows[table] = [dict(row) for row in found]
        return rows, columns


def test_the_rows_are_all_there_and_only_dropped_tables_and_columns_are_gone(
    file: Path,
) -> None:
    before, columns = content(file)

    upgrade(sqlite_url(file))

    after, columns_after = content(file)
    assert before.keys() - after.keys() == DROPPED
    gone = {one for one in columns - columns_after if one[0] not in DROPPED}
    assert gone == DROPPED_COLUMNS
    for name in after.keys() & before.keys():
        left = [
            {key: value for key, value in row.items() if (name, key) not in gone}
            for row in before[name]
        ]
        assert after[name] == left


def test_the_audit_goes_on_behind_its_rows_and_stays_guarded(file: Path) -> None:
    remember(sqlite_url(file), audit_record(audit_id="U4", at=NOON + 9.0))

    with closing(sqlite3.connect(file)) as connection:
        seqs = connection.execute("SELECT seq, audit_id FROM audit ORDER BY seq")
        assert seqs.fetchall() == [(1, "U1"), (2, "U2"), (3, "U3"), (4, "U4")]
        with pytest.raises(sqlite3.IntegrityError, match="append-only"):
            connection.execute("DELETE FROM audit")
