"""Databases for the history's tests: every test begins with one of its own."""

import os
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from iveg.adapters.history.engine import upgrade
from iveg.adapters.history.queries import Queries
from tests.databases import lay_history
from tests.fakes.postgresql import PostgreSQL, programs, running_postgresql


@pytest.fixture(scope="session")
def postgresql() -> Iterator[PostgreSQL]:
    bin_ = programs()
    if bin_ is None:
        assert "CI" not in os.environ, "PostgreSQL must be installed here"
        pytest.skip("PostgreSQL is not installed")
    with running_postgresql(bin_) as server:
        yield server


@pytest.fixture
def sqlite_url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'history.db'}"


@pytest.fixture
def postgresql_url(postgresql: PostgreSQL) -> str:
    return postgresql.empty_database()


@pytest.fixture(params=["sqlite", "postgresql"])
def empty_url(request: pytest.FixtureRequest) -> str:
    """A database without tables."""
    return str(request.getfixturevalue(f"{request.param}_url"))


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """An empty history of the newest shape."""
    if request.param == "postgresql":
        server: PostgreSQL = request.getfixturevalue("postgresql")
        return server.newest_database()
    url = f"sqlite:///{tmp_path / 'history.db'}"
    lay_history(url)
    return url


@pytest.fixture
def queries(database_url: str) -> Iterator[Queries]:
    upgrade(database_url)
    with closing(Queries(database_url)) as queries:
        yield queries
