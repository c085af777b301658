import errno
import os
from dataclasses import asdict
from pathlib import Path

import orjson
import pytest

from iveg.adapters.history.spill_file import SpillFile
from iveg.domain.errors import HopError
from iveg.domain.records import DetectionRecord, OdometryRecord, Record
from iveg.pipeline.record import Waiting
from tests.fakes.disk import files_no_longer_than
from tests.fakes.records import (
    alert_record,
    command_event_record,
    command_record,
    decision_record,
    detection_record,
    log_record,
    odometry_record,
)

EVERYTHING = (
    alert_record(note="¿quién?"),
    command_event_record(),
    command_record(),
    decision_record(),
    log_record(),
)


def rows(*records: Record) -> list[Waiting]:
    return [Waiting(record, number, 5.0) for number, record in enumerate(records, 1)]


class JournalOnFullDisk(SpillFile):
    """There is room for half a line only, until the reserve is gone."""

    def __init__(self, file: Path, reserve: Path) -> None:
        super().__init__(file, 4096)
        self._until_gone = reserve
        self._half_written = False

    def write(self, descriptor: int, data: memoryview) -> int:
        if not self._until_gone.exists():
            return os.write(descriptor, data)
        if self._half_written:
            raise OSError(errno.ENOSPC, "No space left on device")
        self._half_written = True
        return os.write(descriptor, data[: len(data) // 2])


@pytest.fixture
def journal(tmp_path: Path) -> SpillFile:
    return SpillFile(tmp_path / "journal", reserve_bytes=4096)


def test_what_was_written_down_is_read_back(journal: SpillFile) -> None:
    journal.append(rows(*EVERYTHING))

    found, end = journal.read(0, 100)

    assert [row.record for row in found] == list(EVERYTHING)
    assert [row.revision for row in found] == [1, 2, 3, 4, 5]
    assert end == journal.size


def test_a_journal_is_read_in_pieces(journal: SpillFile) -> None:
    journal.append(rows(*EVERYTHING))

    first, middle = journal.read(0, 3)
    second, end = journal.read(middle, 3)

    assert [row.record for row in first + second] == list(EVERYTHING)
    assert end == journal.size


def test_a_journal_that_never_was_is_empty(journal: SpillFile) -> None:
    assert journal.size == 0
    assert journal.read(0, 10) == ([], 0)


def test_a_line_torn_by_a_power_cut_is_counted_and_the_others_count(
    journal: SpillFile, tmp_path: Path
) -> None:
    journal.append(rows(command_record(), log_record()))
    os.truncate(tmp_path / "journal", journal.size - 10)

    found, end = journal.read(0, 10)

    assert [row.record for row in found] == [command_record()]
    assert journal.unreadable == 1
    assert end == journal.size


def test_what_was_appended_meanwhile_is_not_cleared(journal: SpillFile) -> None:
    journal.append(rows(command_record()))
    _, end = journal.read(0, 10)
    journal.append(rows(log_record()))

    assert not journal.clear(end)
    assert journal.clear(journal.size)
    assert journal.size == 0


def test_a_record_that_is_no_text_is_left_out_and_its_neighbours_kept(
    journal: SpillFile,
) -> None:
    journal.append(rows(log_record(key="\ud800"), command_record()))

    found, _ = journal.read(0, 10)

    assert [row.record for row in found] == [command_record()]


def test_a_full_disk_is_told_and_leaves_no_half_line(journal: SpillFile) -> None:
    journal.append(rows(command_record()))
    size = journal.size

    with files_no_longer_than(size + 20), pytest.raises(HopError, match="journal"):
        journal.append(rows(log_record()))

    assert journal.size == size
    journal.append(rows(log_record()))
    assert len(journal.read(0, 10)[0]) == 2


def test_the_reserve_is_really_taken_from_the_disk(
    journal: SpillFile, tmp_path: Path
) -> None:
    journal.keep_reserve()

    assert (tmp_path / "journal-reserve").stat().st_blocks * 512 >= 4096


def test_a_full_disk_gets_the_reserve_back(tmp_path: Path) -> None:
    reserve = tmp_path / "journal-reserve"
    journal = JournalOnFullDisk(tmp_path / "journal", reserve)
    journal.keep_reserve()

    journal.append(rows(command_record()))

    assert not reserve.exists()
    assert [row.record for row in journal.read(0, 10)[0]] == [command_record()]
    assert journal.clear(journal.size)
    assert reserve.exists()


def test_no_room_for_the_reserve_is_no_error(
    journal: SpillFile, tmp_path: Path
) -> None:
    with files_no_longer_than(100):
        journal.keep_reserve()

    assert not (tmp_path / "journal-reserve").exists()


def test_a_line_of_the_version_before_is_read_back_with_its_json(
    journal: SpillFile, tmp_path: Path
) -> None:
    record = asdict(decision_record(links=[])) | {
        "links": '[{"link": "detection", "at": 1.0}]',
        "rule_parameters": "{}",
    }
    line = {"kind": "DecisionRecord", "revision": 1, "record": record}
    (tmp_path / "journal").write_bytes(orjson.dumps(line) + b"\n")

    [row], _ = journal.read(0, 10)

    links = [{"link": "detection", "at": 1.0}]
    assert row.record == decision_record(links=links, rule_parameters={})


def test_an_order_of_the_version_before_is_read_back_with_its_times(
    journal: SpillFile, tmp_path: Path
) -> None:
    record = asdict(command_record()) | {
        "sent_direct_at": 1.5,
        "answer_fiware_at": None,
    }
    del record["sent_at"], record["answer_at"]
    line = {"kind": "CommandRecord", "revision": 1, "record": record}
    (tmp_path / "journal").write_bytes(orjson.dumps(line) + b"\n")

    [row], _ = journal.read(0, 10)

    assert row.record == command_record(sent_at={"direct": 1.5})


@pytest.mark.parametrize(
    ("now", "before"),
    [
        (detection_record(transport="fiware"), {"transport": ("road", "orion")}),
        (odometry_record(limit_factor=0.5), {"limit_factor": ("mandated_factor", 0.5)}),
    ],
)
def test_a_field_of_the_version_before_is_read_back_under_its_name(
    journal: SpillFile,
    tmp_path: Path,
    now: DetectionRecord | OdometryRecord,
    before: dict[str, tuple[str, object]],
) -> None:
    record = {
        key: value for key, value in asdict(now).items() if key not in before
    } | dict(before.values())
    line = {"kind": type(now).__name__, "revision": 1, "record": record}
    (tmp_path / "journal").write_bytes(orjson.dumps(line) + b"\n")

    [row], _ = journal.read(0, 10)

    assert row.record == now


def test_nobody_else_reads_what_waits(tmp_path: Path) -> None:
    spill = SpillFile(tmp_path / "journal.jsonl", 100)
    spill.keep_reserve()
    spill.append([Waiting(command_record(), 1, 0.0)])

    rights = [one.stat().st_mode & 0o777 for one in tmp_path.iterdir()]
    assert rights == [0o600, 0o600]
