"""Exports: the data dictionary, and Parquet from the door and from the command line."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pyarrow import parquet

from iveg.adapters.extras import EXTRAS
from iveg.adapters.history.store import Store
from iveg.adapters.parquet import MOST_OPEN, parquet_end, parquet_page
from iveg.cli import UNUSABLE, main
from iveg.domain.errors import HopError
from iveg.models import column_meanings, dictionary
from iveg.models.dictionary import LISTS, columns_of
from iveg.pipeline.record import Waiting
from iveg.web.api import exports
from tests.fakes.records import (
    NOON,
    command_record,
    odometry_record,
)
from tests.processes import ROOT

ROWS = 2345


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A history of some rows, which the command line finds."""
    monkeypatch.setenv("IVEG_DATA_DIRECTORY", str(tmp_path))
    monkeypatch.delenv("IVEG_DATABASE_URL", raising=False)
    store = Store(f"sqlite:///{tmp_path / 'iveg.sqlite'}")
    rows = [odometry_record(at=NOON + n) for n in range(ROWS)]
    store.write([Waiting(one, n, 0.0) for n, one in enumerate(rows, 1)])
    yield tmp_path
    store.close()


def test_each_column_of_each_list_is_told_and_none_besides() -> None:
    meanings = {
        (name, one.name): one.meaning.means
        for name in LISTS
        for one in columns_of(name)
    }
    assert all(meanings.values())
    names = {column for _, column in meanings}
    assert names == set(column_meanings.MEANINGS)
    assert set(column_meanings.MEANINGS_APART) <= set(meanings)
    for name, kind in LISTS.items():
        head = exports.csv_head(kind).decode().strip().split(",")
        assert head == [one.name for one in columns_of(name)]


def test_the_page_of_columns_is_that_of_the_records() -> None:
    page = (ROOT / "docs/interfaces/exports.md").read_text()
    assert page.endswith("\n\n" + dictionary.describe())


def test_a_list_is_written_whole_as_each_form(data: Path) -> None:
    lines = {}
    for form in ("csv", "ndjson", "parquet"):
        file = data / f"odometry.{form}"
        words = ["export", "odometry", "--format", form, "--out", str(file)]
        assert main(words) == 0
        lines[form] = file
    assert len(lines["csv"].read_text().splitlines()) == 1 + ROWS
    assert len(lines["ndjson"].read_text().splitlines()) == ROWS
    table = parquet.read_table(lines["parquet"])
    assert table.num_rows == ROWS
    first = table.slice(0, 1).to_pylist()[0]
    assert first["at"].timestamp() == NOON + ROWS - 1
    assert (first["robot_id"], first["x"]) == ("AGI", odometry_record().x)
    assert [*data.glob("*.part")] == []


def test_a_range_is_since_inclusive_and_until_exclusive(
    data: Path, capsysbinary: pytest.CaptureFixture[bytes]
) -> None:
    range_ = ("--since", "2023-11-14T22:13:30Z", "--until", "2023-11-14T22:13:40")
    assert main(["export", "odometry", *range_]) == 0
    assert len(capsysbinary.readouterr().out.splitlines()) == 1 + 10


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--since", "yesterday"], "--since='yesterday'"),
        (["--since", "2023-11-15", "--until", "2023-11-14"], "before --until"),
        (["--since", "1926-11-20T09:00:00Z"], "no day of any history"),
        (["--until", "9001-01-01"], "no day of any history"),
        (["--out", "nowhere/at/all.csv"], "No such file"),
    ],
)
def test_what_cannot_be_exported_is_one_sentence(
    data: Path, words: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "odometry", *words]) != 0
    (sentence,) = capsys.readouterr().err.splitlines()
    assert says in sentence


def test_a_device_is_not_replaced_by_a_file(
    data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pipe = data / "pipe"
    os.mkfifo(pipe)
    assert main(["export", "odometry", "--out", str(pipe)]) == 1
    assert "is there and no file" in capsys.readouterr().err
    assert pipe.is_fifo()
    assert [*data.glob("*.part")] == []


def test_a_reader_that_leaves_early_is_one_sentence(data: Path) -> None:
    command = [sys.executable, "-m", "iveg", "export", "odometry"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        (sentence,) = process.stderr.read().splitlines()
    assert process.returncode == 1
    assert sentence == "iveg: output: Broken pipe"


def test_without_its_library_the_command_says_what_to_install(
    data: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, EXTRAS["parquet"], None)
    file = data / "odometry.parquet"
    words = ["export", "odometry", "--format", "parquet", "--out", str(file)]
    assert main(words) == UNUSABLE
    assert "pip install 'iveg[parquet]'" in capsys.readouterr().err
    assert not file.exists()


def test_json_inside_a_cell_is_text_and_what_is_missing_is_null(tmp_path: Path) -> None:
    file = tmp_path / "commands.parquet"
    one = command_record(goal={"kind": "place", "x": 1.0}, sent_at={"direct": NOON})
    pieces = parquet_page("k", "commands", 0, [one]), parquet_end("k", 1)
    file.write_bytes(b"".join(pieces))
    (row,) = parquet.read_table(file).to_pylist()
    assert row["goal"] == '{"kind":"place","x":1.0}'
    assert row["sent_direct_at"].timestamp() == NOON
    assert row["sent_fiware_at"] is None
    assert row["drill"] is False


def test_an_export_whose_beginning_is_lost_is_not_patched_up() -> None:
    parquet_page("first", "odometry", 0, [])
    with pytest.raises(HopError, match="lost"):
        parquet_page("first", "odometry", 2, [])
    for n in range(MOST_OPEN):
        parquet_page(f"k{n}", "odometry", 0, [])
    with pytest.raises(HopError, match="lost"):
        parquet_end("first", 1)
