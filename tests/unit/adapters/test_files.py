"""iVeg's own files are there whole or not at all, and say what they are."""

from pathlib import Path

import pytest

from iveg.adapters.files import AppendedFile, Form, read_lines, write_lines
from iveg.domain.errors import DataFileError

FORM = Form("notes", 2)


def test_what_was_written_is_read_with_the_number_of_its_line(tmp_path: Path) -> None:
    write_lines(tmp_path / "notes", FORM, [{"a": 1}, [2]])

    assert list(read_lines(tmp_path / "notes", FORM)) == [(2, b'{"a":1}'), (3, b"[2]")]


def test_a_file_is_its_owners_alone_and_nothing_is_left_beside_it(
    tmp_path: Path,
) -> None:
    write_lines(tmp_path / "notes", FORM, [])
    write_lines(tmp_path / "notes", FORM, [])

    assert [one.name for one in tmp_path.iterdir()] == ["notes"]
    assert (tmp_path / "notes").stat().st_mode & 0o777 == 0o600


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path) -> None:
    write_lines(tmp_path / "notes", FORM, ["old"])
    (tmp_path / "notes.new").mkdir()

    with pytest.raises(OSError, match="notes"):
        write_lines(tmp_path / "notes", FORM, ["new"])

    assert list(read_lines(tmp_path / "notes", FORM)) == [(2, b'"old"')]


def test_a_file_of_the_time_before_has_no_first_line(tmp_path: Path) -> None:
    (tmp_path / "notes").write_bytes(b'{"a": 1}\n\n{"b": 2}\n')

    assert [number for number, _ in read_lines(tmp_path / "notes", FORM)] == [1, 3]


def test_without_a_file_there_are_no_lines(tmp_path: Path) -> None:
    assert list(read_lines(tmp_path / "notes", FORM)) == []


@pytest.mark.parametrize(
    ("other", "says"),
    [
        (Form("notes", 3), "it holds notes 3; this iVeg reads notes 2"),
        (Form("rules", 1), "it holds rules 1"),
    ],
)
def test_a_file_of_a_newer_iveg_or_another_kind_is_not_guessed_at(
    tmp_path: Path, other: Form, says: str
) -> None:
    write_lines(tmp_path / "notes", other, ["x"])

    with pytest.raises(DataFileError, match=says):
        list(read_lines(tmp_path / "notes", FORM))


def test_a_line_after_a_torn_one_stands_by_itself(tmp_path: Path) -> None:
    notes = AppendedFile(tmp_path / "deep" / "notes", FORM)
    notes.append("first")
    notes.close()
    with (tmp_path / "deep" / "notes").open("ab") as file:
        file.write(b'"cut sh')

    notes.append("second")
    notes.close()

    lines = [line for _, line in read_lines(tmp_path / "deep" / "notes", FORM)]
    assert lines == [b'"first"', b'"cut sh', b'"second"']
