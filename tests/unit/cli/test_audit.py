"""``iveg audit``: one sentence where the chain holds, one for each row where not."""

from argparse import Namespace
from functools import partial
from pathlib import Path

import pytest
from sqlalchemy import Connection, text

from iveg.adapters.history.store import Store
from iveg.cli import audit
from iveg.cli.arguments import CommandCall
from iveg.pipeline.record import Waiting
from iveg.settings import Settings
from tests.fakes.records import audit_record


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'history.db'}")
    store = Store(settings.database_url)
    rows = [audit_record(audit_id=f"A{n}") for n in range(1, 4)]
    store.write([Waiting(one, n, 0.0) for n, one in enumerate(rows)])
    store.close()
    return settings


def ask(action: str, settings: Settings, data: Path) -> int:
    return audit.run(CommandCall(Namespace(action=action), settings, {}, data))


def test_a_whole_chain_is_told_with_its_end(
    settings: Settings, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = ask("verify", settings, tmp_path), ask("end", settings, tmp_path)

    told = capsys.readouterr().out
    seq, hash_ = told.splitlines()[-1].split()
    assert code == (0, 0)
    assert seq == "3"
    assert "Rows 1 to 3 are as they were written." in told
    assert f"The chain ends with {hash_}." in told


def _execute(lie: str, connection: Connection) -> None:
    connection.execute(text(lie))


def test_a_row_that_was_changed_is_named(
    settings: Settings, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = Store(settings.database_url)
    for lie in (
        "DROP TRIGGER audit_no_update",
        "UPDATE audit SET name = 'Eva' WHERE seq = 2",
    ):
        store.run(partial(_execute, lie))
    store.close()

    code = ask("verify", settings, tmp_path)

    assert code == 1
    assert capsys.readouterr().out.splitlines()[0] == (
        "Row 2 was changed: its hash is not that of its values."
    )
