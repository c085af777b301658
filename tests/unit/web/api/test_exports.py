"""Exports: the page of columns, and files from the command line."""

from pathlib import Path

import pytest

from iveg.cli import main
from iveg.domain.records import LISTS, SHOWN_COLUMNS
from iveg.models import dictionary
from iveg.web.api import exports
from tests.databases import remember
from tests.fakes.records import NOON, odometry_record
from tests.processes import ROOT

ROWS = 2345


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A history of some rows, which the command line finds."""
    monkeypatch.setenv("IVEG_DATA_DIRECTORY", str(tmp_path))
    monkeypatch.delenv("IVEG_DATABASE_URL", raising=False)
    rows = (odometry_record(at=NOON + n) for n in range(ROWS))
    remember(f"sqlite:///{tmp_path / 'iveg.sqlite'}", *rows)
    return tmp_path


def test_each_column_of_each_list_is_told_and_in_its_file() -> None:
    for kind in LISTS.values():
        assert all(one.meaning.means for one in SHOWN_COLUMNS[kind])
        head = exports.csv_lines(kind, [], has_head=True).decode().strip().split(",")
        assert head == [one.name for one in SHOWN_COLUMNS[kind]]


def test_the_page_of_columns_is_that_of_the_records() -> None:
    page = (ROOT / "docs/interfaces/columns.md").read_text()
    assert page == dictionary.describe()


def test_a_list_is_written_whole_as_each_form(data: Path) -> None:
    for form, lines in (("csv", 1 + ROWS), ("ndjson", ROWS)):
        file = data / f"odometry.{form}"
        words = ["export", "odometry", "--format", form, "--out", str(file)]
        assert main(words) == 0
        assert len(file.read_text().splitlines()) == lines
    assert [*data.glob("*.part")] == []


def test_what_cannot_be_exported_is_one_sentence(
    data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "odometry", "--out", f"{data}/nowhere/at/all.csv"]) != 0
    (sentence,) = capsys.readouterr().err.splitlines()
    assert "No such file" in sentence
