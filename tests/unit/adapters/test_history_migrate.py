import sqlite3
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import Connection, text

from iveg.adapters.history.engine import sqlite_url, upgrade, writing_engine
from iveg.adapters.history.tables import EARLIER, metadata
from iveg.domain.errors import DataFileError

PARTS = "odometry_", "detections_"


def execute(empty_url: str, statement: str) -> None:
    engine = writing_engine(empty_url)
    with engine.begin() as connection:
        connection.execute(text(statement))
    engine.dispose()


def differences(connection: Connection) -> list[object]:
    def is_whole(name: str, kind: str, _: object) -> bool:
        return kind != "table" or not name.startswith((*PARTS, *EARLIER))

    opts = {"compare_type": True, "include_name": is_whole}
    migrated = MigrationContext.configure(connection, opts=opts)
    return list(compare_metadata(migrated, metadata))


def test_migrations_make_the_tables_that_the_code_describes(empty_url: str) -> None:
    upgrade(empty_url)

    engine = writing_engine(empty_url)
    with engine.connect() as connection:
        assert differences(connection) == []
    engine.dispose()


def test_a_newer_database_is_refused_with_one_sentence(empty_url: str) -> None:
    upgrade(empty_url)
    execute(empty_url, "UPDATE alembic_version SET version_num = 'from_the_future'")

    with pytest.raises(DataFileError, match=r"newer iVeg .*from_the_future") as caught:
        upgrade(empty_url)

    assert "\n" not in str(caught.value)


def test_an_unfinished_migration_is_refused_and_left_as_it_was(
    empty_url: str,
) -> None:
    execute(empty_url, "CREATE TABLE log (id INTEGER)")

    with pytest.raises(DataFileError, match=r"cannot be finished .*log"):
        upgrade(empty_url)

    engine = writing_engine(empty_url)
    with engine.connect() as connection:
        found = MigrationContext.configure(connection).get_current_revision()
    engine.dispose()
    assert found is None


@pytest.mark.parametrize("place", [0, 8192], ids=["its head", "a page"])
def test_a_damaged_file_is_moved_aside_and_a_fresh_one_begun(
    tmp_path: Path, sqlite_url: str, place: int
) -> None:
    upgrade(sqlite_url)
    file = tmp_path / "history.db"
    damaged = bytearray(file.read_bytes())
    damaged[place : place + 4096] = bytes([0xA5]) * 4096
    file.write_bytes(damaged)

    upgrade(sqlite_url)
    upgrade(sqlite_url)

    [aside] = tmp_path.glob("history.db.corrupt-*")
    assert aside.read_bytes() == damaged


@pytest.mark.parametrize("before", [(), ("iveg.sqlite",)], ids=["new", "old"])
def test_nobody_else_reads_the_file_of_the_history(
    tmp_path: Path, before: tuple[str, ...]
) -> None:
    file = tmp_path / "iveg.sqlite"
    for name in before:
        (tmp_path / name).touch(0o644)
    url = sqlite_url(file)

    upgrade(url)
    engine = writing_engine(url)
    with engine.connect() as connection:
        connection.execute(text("DELETE FROM log"))
        rights = {
            one.name: one.stat().st_mode & 0o777 for one in sorted(tmp_path.iterdir())
        }
    engine.dispose()

    assert rights == dict.fromkeys(("iveg.sqlite", "iveg.sqlite-journal"), 0o600)


def test_a_file_of_an_earlier_version_in_wal_is_in_it_no_longer(tmp_path: Path) -> None:
    file = tmp_path / "iveg.sqlite"
    with sqlite3.connect(file) as earlier:
        earlier.execute("PRAGMA journal_mode=WAL")
        earlier.execute("CREATE TABLE kept (row)")
        earlier.execute("INSERT INTO kept VALUES (1)")
        earlier.commit()
    earlier.close()

    upgrade(sqlite_url(file))

    with sqlite3.connect(file) as now:
        assert now.execute("PRAGMA journal_mode").fetchone() == ("delete",)
        assert now.execute("SELECT row FROM kept").fetchall() == [(1,)]
    assert [*tmp_path.glob("iveg.sqlite-*")] == []
