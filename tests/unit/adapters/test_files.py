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


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "notes"


def lines_of(path: Path) -> list[bytes]:
    return [line for _, line in read_lines(path, FORM)]


def test_a_file_is_its_owners_alone_and_nothing_is_left_beside_it(
    path: Path,
) -> None:
    write_lines(path, FORM, [])
    write_lines(path, FORM, [])

    assert [one.name for one in path.parent.iterdir()] == ["notes"]
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_write_that_fails_leaves_the_old_file(path: Path) -> None:
    write_lines(path, FORM, ["old"])
    path.with_suffix(".new").mkdir()

    with pytest.raises(OSError, match="notes"):
        write_lines(path, FORM, ["new"])

    assert lines_of(path) == [b'"old"']


@pytest.mark.parametrize(
    ("other", "says"),
    [
        (Form("notes", 3), "it holds notes 3; this iVeg reads notes 2"),
        (Form("rules", 1), "it holds rules 1"),
    ],
)
def test_a_file_of_a_newer_iveg_or_another_kind_is_not_guessed_at(
    path: Path, other: Form, says: str
) -> None:
    write_lines(path, other, ["x"])

    with pytest.raises(DataFileError, match=says):
        list(read_lines(path, FORM))


def test_a_line_after_a_torn_one_stands_by_itself(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "notes"
    notes = ReservedFile(path, FORM)
    notes.append(b'"first"\n')
    notes.close()
    with path.open("ab") as file:
        file.write(b'"cut sh')

    notes.append(b'"second"\n')
    notes.close()

    assert lines_of(path) == [b'"first"', b'"cut sh', b'"second"']


def test_room_for_a_megabyte_more_is_taken_from_the_disk_ahead(path: Path) -> None:
    notes = ReservedFile(path, FORM)

    notes.append(b'"first"\n')

    taken = path.stat()
    assert taken.st_size - notes.size >= RESERVE_BYTES
    assert taken.st_blocks * 512 >= RESERVE_BYTES
    assert lines_of(path) == [b'"first"']
    notes.close()
    assert path.stat().st_size == notes.size


def test_what_the_disk_did_not_take_is_in_no_part_there_and_the_file_goes_on(
    path: Path,
) -> None:
    notes = ReservedFile(path, FORM)
    notes.append(b'"first"\n')
    size = path.stat().st_size

    with files_no_longer_than(size), pytest.raises(OSError, match=r"written|large"):
        notes.append(b"1\n" * size)
    with files_no_longer_than(RESERVE_BYTES), pytest.raises(OSError, match="large"):
        notes.rewrite(b'"new"\n')

    notes.append(b'"second"\n')
    notes.close()
    assert lines_of(path) == [b'"first"', b'"second"']
    assert [one.name for one in path.parent.iterdir()] == ["notes"]
