import pytest
from sqlalchemy import text

from iveg.adapters.database_check import check_database
from iveg.adapters.history.engine import upgrade, writing_engine
from iveg.domain.errors import HopError


def test_a_history_of_the_newest_shape_is_well_and_that_of_a_newer_iveg_is_told(
    database_url: str,
) -> None:
    upgrade(database_url)
    check_database(database_url)
    engine = writing_engine(database_url)
    with engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = 'ffff'"))
    engine.dispose()

    with pytest.raises(HopError, match=r"newer iVeg wrote it \(migration ffff"):
        check_database(database_url)


def test_a_server_that_is_away_is_told_without_its_password() -> None:
    with pytest.raises(HopError) as away:
        check_database("postgresql://iveg:secret-word@127.0.0.1:1/iveg")

    assert "refused" in str(away.value)
    assert "secret-word" not in str(away.value)
