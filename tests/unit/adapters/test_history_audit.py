"""The audit on both databases: only retention deletes rows, and nothing changes one."""

from collections.abc import Iterator

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.recorder import Store
from iveg.adapters.history.upkeep import purge_piece
from iveg.domain.retention import PurgeStep
from iveg.vital.record import Waiting
from tests.fakes.records import NOON, audit_record

STEP = PurgeStep("audit", "audit")


@pytest.fixture
def store(database_url: str) -> Iterator[Store]:
    store = Store(database_url)
    store.write([_waiting(number) for number in range(1, 6)])
    yield store
    store.close()


def _waiting(number: int) -> Waiting:
    record = audit_record(audit_id=f"A{number}", at=NOON + number)
    return Waiting(record, number, 0.0)


def ids(store: Store) -> list[str]:
    query = text("SELECT audit_id FROM audit ORDER BY seq")
    return store.run(lambda one: list(one.scalars(query)))


def refused(database_url: str, statement: str) -> None:
    engine = reading_engine(database_url)
    with engine.connect() as connection, pytest.raises(DBAPIError, match="append-only"):
        connection.execute(text(statement))
    engine.dispose()


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE audit SET name = 'Eva' WHERE seq = 3",
        "DELETE FROM audit WHERE seq = 1",
        "DELETE FROM audit",
    ],
)
def test_the_database_itself_refuses_changes(
    store: Store, database_url: str, statement: str
) -> None:
    refused(database_url, statement)

    assert len(ids(store)) == 5


def test_retention_alone_takes_what_is_over_and_the_rest_stays_guarded(
    store: Store, database_url: str
) -> None:
    took = store.run(lambda one: purge_piece(one, STEP, NOON + 4.0))

    assert (took, ids(store)) == (3, ["A4", "A5"])
    refused(database_url, "DELETE FROM audit")
