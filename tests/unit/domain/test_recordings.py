"""Which recordings go: the oldest, by days with a recording and by size; low disks."""

import pytest

from iveg.domain.recordings import RecordingFile, RecordingLimits, superfluous
from iveg.domain.retention import DiskSpace

GB = 10**9


def recording(name: str, size: int = 10, *, is_open: bool = False) -> RecordingFile:
    return RecordingFile(name + ".mcap", size, is_open, 0.0)


DAYS = [
    recording(f"2026-11-{day}T{hour}-00-00Z") for day in (20, 21, 24) for hour in (8, 9)
]


def names(limits: RecordingLimits, files: list[RecordingFile] = DAYS) -> list[str]:
    return sorted(one.name[:13] for one in superfluous(reversed(files), limits))


def test_days_without_a_recording_do_not_count() -> None:
    assert names(RecordingLimits(days=3, most_bytes=0)) == []
    oldest = ["2026-11-20T8-", "2026-11-20T9-"]
    assert names(RecordingLimits(days=2, most_bytes=0)) == oldest


def test_the_oldest_go_until_the_rest_has_room() -> None:
    assert names(RecordingLimits(days=0, most_bytes=60)) == []
    assert names(RecordingLimits(days=0, most_bytes=59)) == ["2026-11-20T8-"]
    assert len(names(RecordingLimits(days=0, most_bytes=1))) == 6


def test_the_one_that_is_written_stays() -> None:
    files = [recording("2026-11-19T08", 100, is_open=True), *DAYS]
    gone = names(RecordingLimits(days=1, most_bytes=1), files)
    assert len(gone) == 6
    assert "2026-11-19T08" not in gone


@pytest.mark.parametrize(
    ("free", "total", "low"),
    [
        (GB, 500 * GB, False),
        (GB - 1, 500 * GB, True),
        (GB // 2, 10 * GB, False),
        (GB // 2 - 1, 10 * GB, True),
        (0, 0, False),
    ],
)
def test_low_is_below_the_lesser_of_a_gigabyte_and_a_twentieth(
    free: int, total: int, low: bool
) -> None:
    assert DiskSpace(free, total).is_low(was_low=False) is low
