"""Accounts and tokens of the version before are read until they have moved."""

from iveg.adapters.history.queries import earlier_access, mark_moved
from iveg.domain.accounts import Access, Account, ApiToken
from tests.databases import put_into_tables

ANA = Account("P1", "Ana", "operator", password="#hash", ends_at=2e9, since=1.5)
MES = ApiToken("T1", "MES", "stop", "ab" * 32, 1.0, used_at=2.0)


def test_they_are_read_as_they_were_and_never_again_once_they_have_moved(
    database_url: str,
) -> None:
    put_into_tables(database_url, ANA, MES)

    before = earlier_access(database_url)
    mark_moved(database_url, 3.0)

    assert before == Access((ANA,), (MES,))
    assert earlier_access(database_url) is None
