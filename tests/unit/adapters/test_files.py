"""iVeg's own files are there whole or not at all, and say what they are."""

from pathlib import Path

import pytest

from iveg.adapters.files import (
    RESERVE_BYTES,
    Form,
    ReservedFile,
    read_lines,
    write_lines,
)
from iveg.domain.errors import DataFileError
from tests.fakes.disk import files_no_longer_than

FORM = Form("notes", 2)


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
    notes = ReservedFile(tmp_path / "deep" / "notes", FORM)
    notes.append(b'"first"\n')
    notes.close()
    with (tmp_path / "deep" / "notes").open("ab") as file:
        file.write(b'"cut sh')

    notes.append(b'"second"\n')
    notes.close()

    lines = [line for _, line in read_lines(tmp_path / "deep" / "notes", FORM)]
    assert lines == [b'"first"', b'"cut sh', b'"second"']


def test_room_for_a_megabyte_more_is_taken_from_the_disk_ahead(tmp_path: Path) -> None:
    notes = ReservedFile(tmp_path / "notes", FORM)

    notes.append(b'"first"\n')

    taken = (tmp_path / "notes").stat()
    assert taken.st_size - notes.size >= RESERVE_BYTES
    assert taken.st_blocks * 512 >= RESERVE_BYTES
    assert [line for _, line in read_lines(tmp_path / "notes", FORM)] == [b'"first"']
    notes.close()
    assert (tmp_path / "notes").stat().st_size == notes.size


def test_a_full_disk_takes_lines_within_the_reserve(tmp_path: Path) -> None:
    notes = ReservedFile(tmp_path / "notes", FORM)
    notes.open()
    size = (tmp_path / "notes").stat().st_size

    # As on a full disk no file grows: not by a byte.
    with files_no_longer_than(size):
        for _ in range(10):
            notes.append(b"1" * 100_000 + b"\n")
    notes.close()

    assert len(list(read_lines(tmp_path / "notes", FORM))) == 10


def test_lines_that_the_disk_did_not_take_are_in_no_part_there(tmp_path: Path) -> None:
    notes = ReservedFile(tmp_path / "notes", FORM)
    notes.append(b'"first"\n')
    size = (tmp_path / "notes").stat().st_size

    with files_no_longer_than(size), pytest.raises(OSError, match=r"written|large"):
        notes.append(b"1\n" * size)

    notes.append(b'"second"\n')
    notes.close()
    lines = [line for _, line in read_lines(tmp_path / "notes", FORM)]
    assert lines == [b'"first"', b'"second"']


def test_a_file_that_cannot_be_rewritten_stands(tmp_path: Path) -> None:
    notes = ReservedFile(tmp_path / "notes", FORM)
    notes.append(b'"first"\n')

    with files_no_longer_than(RESERVE_BYTES), pytest.raises(OSError, match="large"):
        notes.rewrite(b'"new"\n')

    notes.append(b'"second"\n')
    notes.close()
    lines = [line for _, line in read_lines(tmp_path / "notes", FORM)]
    assert lines == [b'"first"', b'"second"']
    assert [one.name for one in tmp_path.iterdir()] == ["notes"]
