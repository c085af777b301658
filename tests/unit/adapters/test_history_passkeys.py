"""Passkeys in the database: kept once, removed by their person, gone with a reset."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from sqlalchemy import select

from iveg.adapters.history.accounts import AccountStore
from iveg.adapters.history.engine import reading_engine
from iveg.adapters.history.passkeys import PasskeyStore
from iveg.adapters.history.tables import audit
from iveg.domain.accounts import Account
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import NameTakenError, UnknownNameError
from iveg.domain.passkeys import Passkey

KEY = Passkey("c2FtZQ", "P1", "llave", "iveg.test", "cHVibGlj", 0, 1000.0)


@pytest.fixture
def store(database_url: str) -> Iterator[PasskeyStore]:
    store = PasskeyStore(database_url)
    store.add(KEY, CONSOLE)
    yield store
    store.close()


def test_a_credential_is_kept_once_and_its_use_beside_it(store: PasskeyStore) -> None:
    used = replace(KEY, sign_count=2**32 - 1, used_at=1060.5)
    with pytest.raises(NameTakenError):
        store.add(replace(KEY, account_id="P2"), CONSOLE)
    store.used([used, replace(KEY, credential_id="gone")])

    assert store.read() == {"c2FtZQ": used}


def test_only_its_person_removes_it_and_the_audit_says_so(
    store: PasskeyStore, database_url: str
) -> None:
    with pytest.raises(UnknownNameError):
        store.remove("P2", "c2FtZQ", CONSOLE)
    store.remove("P1", "c2FtZQ", CONSOLE)
    engine = reading_engine(database_url)
    with engine.connect() as connection:
        told = [*connection.execute(select(audit.c.action, audit.c.subject))]
    engine.dispose()

    assert store.read() == {}
    assert told == [("passkey_added", "llave"), ("passkey_removed", "llave")]


def test_who_begins_anew_has_no_passkey_of_before(
    store: PasskeyStore, database_url: str
) -> None:
    accounts = AccountStore(database_url)
    ana = Account("P1", "Ana", "viewer", invitation="abc", invited_until=2000.0)
    accounts.together(lambda rows: rows.add(ana, CONSOLE))
    store.add(replace(KEY, credential_id="evas", account_id="P2"), CONSOLE)
    accounts.accept("abc", "#hash", 1500.0)
    accounts.close()

    assert set(store.read()) == {"evas"}
