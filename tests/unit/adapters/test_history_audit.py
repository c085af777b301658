"""The audit's chain on both databases: what breaks it is found, and refused before."""

from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import TypeVar

import pytest
from sqlalchemy import Connection, insert, text
from sqlalchemy.exc import DBAPIError

from iveg.adapters import clock
from iveg.adapters.history import audit, tables
from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.purge import count_due, purge_batch
from iveg.adapters.history.store import Store
from iveg.domain.audit import ITSELF, AuditFault, ChainEnd, chained
from iveg.domain.errors import HopError
from iveg.domain.records import AuditRecord
from iveg.domain.retention import DAY_S, PurgeStep
from iveg.pipeline.record import Waiting
from tests.fakes.records import NOON, audit_record

T = TypeVar("T")
STEP = PurgeStep("audit", "audit")


@pytest.fixture
def store(database_url: str) -> Iterator[Store]:
    store = Store(database_url)
    store.write([_waiting(number) for number in range(1, 6)])
    yield store
    store.close()


def _waiting(number: int, **fields: object) -> Waiting:
    record = audit_record(audit_id=f"A{number}", at=NOON + number, **fields)
    return Waiting(record, number, 0.0)


def faults(database_url: str) -> list[AuditFault]:
    return _ask(database_url, lambda one: list(audit.faults(one)))


def _ask(database_url: str, question: Callable[[Connection], T]) -> T:
    engine = reading_engine(database_url)
    try:
        with engine.connect() as connection:
            return question(connection)
    finally:
        engine.dispose()


def tamper(store: Store, *statements: str) -> None:
    """Change the table past its triggers, as whoever owns the database can."""

    def work(connection: Connection) -> None:
        if connection.dialect.name == "postgresql":
            connection.execute(text("ALTER TABLE audit DISABLE TRIGGER USER"))
        else:
            for name in ("audit_no_update", "audit_no_delete"):
                connection.execute(text(f"DROP TRIGGER {name}"))
        for statement in statements:
            connection.execute(text(statement))

    store.run(work)


def test_rows_are_numbered_without_a_gap_and_chained_over_batches(
    store: Store, database_url: str
) -> None:
    store.write([_waiting(6), _waiting(7)])
    store.close()

    numbers = _ask(
        database_url,
        lambda one: list(one.scalars(text("SELECT seq FROM audit ORDER BY seq"))),
    )
    assert numbers == [1, 2, 3, 4, 5, 6, 7]
    assert faults(database_url) == []


def test_a_row_that_is_offered_again_is_stored_once(
    store: Store, database_url: str
) -> None:
    store.write([_waiting(5), _waiting(6)])

    assert _ask(database_url, audit.chain_end).seq == 6
    assert faults(database_url) == []


@pytest.mark.parametrize(
    ("lies", "found"),
    [
        (("UPDATE audit SET name = 'Eva' WHERE seq = 3",), [(3, "changed")]),
        (("UPDATE audit SET at = at + 0.001 WHERE seq = 3",), [(3, "changed")]),
        (("UPDATE audit SET details = '{}' WHERE seq = 1",), [(1, "changed")]),
        (("DELETE FROM audit WHERE seq = 3",), [(3, "missing")]),
        (("DELETE FROM audit WHERE seq = 1",), [(1, "missing")]),
        (("DELETE FROM audit WHERE seq = 5",), [(5, "missing")]),
        (("DELETE FROM audit",), [(1, "missing")]),
        (
            (
                "UPDATE audit SET seq = 99 WHERE seq = 2",
                "UPDATE audit SET seq = 2 WHERE seq = 3",
                "UPDATE audit SET seq = 3 WHERE seq = 99",
            ),
            [(2, "unlinked"), (2, "changed"), (3, "unlinked"), (3, "changed")],
        ),
        (
            ("UPDATE audit SET hash = previous_hash WHERE seq = 4",),
            [(4, "changed"), (5, "unlinked")],
        ),
    ],
)
def test_one_row_that_was_changed_removed_or_swapped_is_found(
    store: Store,
    database_url: str,
    lies: tuple[str, ...],
    found: list[tuple[int, str]],
) -> None:
    tamper(store, *lies)

    told = [(one.seq, one.what) for one in faults(database_url)]
    assert told[: len(found)] == found


def test_a_last_row_that_was_written_anew_with_a_right_hash_is_found(
    store: Store, database_url: str
) -> None:
    honest = _ask(database_url, audit.chain_end)
    tamper(store, "DELETE FROM audit WHERE seq = 5")
    forged = _ask(database_url, lambda one: _forged(one, name="Eva"))
    store.run(lambda one: one.execute(insert(tables.audit).values(**asdict(forged))))

    assert forged.seq == honest.seq
    assert faults(database_url) == [AuditFault(5, "unlinked")]


def _forged(connection: Connection, **fields: object) -> AuditRecord:
    last = connection.execute(text("SELECT hash FROM audit WHERE seq = 4")).one()
    record = audit_record(audit_id="A5", at=NOON + 5, **fields)
    (row,) = chained([record], ChainEnd(4, last.hash), NOON)
    return row


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
    engine = reading_engine(database_url)
    with engine.connect() as connection, pytest.raises(DBAPIError, match="append-only"):
        connection.execute(text(statement))
    engine.dispose()

    assert faults(database_url) == []


def test_retention_takes_whole_days_and_the_rest_still_holds(
    store: Store, database_url: str
) -> None:
    _move_back(store, days=2)
    store.write([_waiting(6), _waiting(7)])
    now = _stored_at(database_url, 7)
    before = now - DAY_S

    due = _ask(database_url, lambda one: count_due(one, STEP, before))
    took = store.run(lambda one: purge_batch(one, STEP, before, lambda: 0.0))
    store.write([_waiting(8)])

    assert (due, took.rows, took.is_last) == (5, 5, True)
    assert _ask(database_url, audit.sealed_end).seq == 5
    assert faults(database_url) == []
    with pytest.raises(HopError, match="append-only"):
        store.run(lambda one: one.execute(text("DELETE FROM audit_sealed")))


def test_a_day_that_is_not_over_stays_whole(store: Store, database_url: str) -> None:
    before = _stored_at(database_url, 5)

    took = store.run(lambda one: purge_batch(one, STEP, before, lambda: 0.0))

    assert took.rows == 0
    assert _ask(database_url, audit.sealed_end) == ChainEnd()


def _move_back(store: Store, days: int) -> None:
    """Have the rows so far been stored earlier, with hashes that fit."""

    def work(connection: Connection) -> None:
        rows = [audit_record(audit_id=f"A{n}", at=NOON + n) for n in range(1, 6)]
        for table in ("audit", "audit_end"):
            connection.execute(text(f"DELETE FROM {table}"))  # noqa: S608
        audit.write_audit(connection, rows, clock.wall() - days * DAY_S)

    tamper(store)
    store.run(work)
    _guard_again(store)


def _guard_again(store: Store) -> None:
    def work(connection: Connection) -> None:
        if connection.dialect.name == "postgresql":
            connection.execute(text("ALTER TABLE audit ENABLE TRIGGER USER"))

    store.run(work)


def _stored_at(database_url: str, seq: int) -> float:
    query = text("SELECT stored_at FROM audit WHERE seq = :seq")
    return float(
        _ask(database_url, lambda one: one.execute(query, {"seq": seq}).scalar_one())
    )


def test_what_iveg_does_itself_has_a_name() -> None:
    assert (ITSELF.name, ITSELF.role) == ("iVeg", "system")
