import pytest
from sqlalchemy import text

from iveg.adapters.database_check import check_database
from iveg.adapters.history.engine import upgrade, writing_engine
from iveg.domain.errors import HopError


def set_revision(database_url: str, revision: str) -> None:
    engine = writing_engine(database_url)
    with engine.connect() as connection, connection.begin():
        change = text("UPDATE alembic_version SET version_num = :revision")
        connection.execute(change, {"revision": revision})
    engine.dispose()


def test_a_history_of_the_newest_shape_is_well(database_url: str) -> None:
    upgrade(database_url)

    check_database(database_url)


def test_a_history_of_a_newer_iveg_is_told_from_an_old_one(database_url: str) -> None:
    upgrade(database_url)
    set_revision(database_url, "ffffffffffff")

    with pytest.raises(HopError, match=r"newer iVeg wrote it \(migration ffffffffffff"):
        check_database(database_url)


def test_a_server_that_is_away_is_told_without_its_password() -> None:
    with pytest.raises(HopError) as away:
        check_database("postgresql://iveg:secret-word@127.0.0.1:1/iveg")

    assert "refused" in str(away.value)
    assert "secret-word" not in str(away.value)
