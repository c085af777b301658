"""Which recordings go: the oldest, by days with a recording and by size."""

from iveg.domain.recordings import RecordingFile, RecordingLimits, superfluous


def recording(name: str, size: int = 10, *, is_open: bool = False) -> RecordingFile:
    return RecordingFile(name + ".mcap", size, is_open, 0.0)


DAYS = [
    recording(f"2026-11-{day}T{hour}-00-00Z") for day in (20, 21, 24) for hour in (8, 9)
]


def names(limits: RecordingLimits, files: list[RecordingFile] = DAYS) -> list[str]:
    return sorted(one.name[:13] for one in superfluous(reversed(files), limits))


def test_days_without_a_recording_do_not_count() -> None:
    assert names(RecordingLimits(days=3, most_bytes=0)) == []
    assert names(RecordingLimits(days=2, most_bytes=0)) == [
        "2026-11-20T8-",
        "2026-11-20T9-",
    ]


def test_the_oldest_go_until_the_rest_has_room() -> None:
    assert names(RecordingLimits(days=0, most_bytes=60)) == []
    assert names(RecordingLimits(days=0, most_bytes=59)) == ["2026-11-20T8-"]
    assert len(names(RecordingLimits(days=0, most_bytes=1))) == 6


def test_the_one_that_is_written_stays() -> None:
    files = [recording("2026-11-19T08", 100, is_open=True), *DAYS]
    gone = names(RecordingLimits(days=1, most_bytes=1), files)
    assert len(gone) == 6
    assert "2026-11-19T08" not in gone
