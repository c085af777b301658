"""Recordings as one line of time: where a moment is, and what leads on from it."""

from pathlib import Path

import pytest

from iveg.adapters.recordings.chunks import ChunkedRecording
from iveg.adapters.recordings.mcap_file import Channel, McapFile
from iveg.adapters.recordings.timeline import Found, Timeline
from iveg.domain.observations import Instant

NS = 10**9
WALL = 1_700_000_000
MEMORY, OTHER = Channel("/iveg/memory", "m"), Channel("/iveg/steps", "s")
LATE = Channel("/iveg/alert", "a")


def write(folder: Path, wall: float, seconds: int, *, is_open: bool = False) -> Path:
    """A file with a chunk a second, and a channel that comes last of all."""
    path = folder / f"{wall:.0f}.mcap.open"
    file = McapFile(path, Instant(wall - WALL, wall))
    for second in range(seconds):
        at = round(wall * NS) + second * NS
        file.add_at(MEMORY, at, b"%d" % second)
        file.add_at(OTHER, at + NS // 2, b"{}")
        file.settle()
    file.add_at(LATE, round(wall * NS) + seconds * NS, b"{}")
    file.settle()
    if is_open:
        file.abandon()
        return path
    file.finish()
    return path.rename(path.with_suffix(""))


def latest(timeline: Timeline, wall: float) -> Found | None:
    return timeline.latest(MEMORY.topic, round(wall * NS), 5 * NS)


@pytest.mark.parametrize("is_open", [True, False])
def test_a_file_tells_its_chunks_alike_with_and_without_an_index(
    tmp_path: Path, is_open: bool
) -> None:
    file = ChunkedRecording(write(tmp_path, WALL, 9, is_open=is_open))

    assert [one.first - file.first for one in file.chunks] == [
        n * NS for n in range(10)
    ]
    # A channel that was said long before is known without reading all that is between.
    assert [one.topic for one in file.read(9)] == [LATE.topic]
    assert [one.payload for one in file.read(8)] == [b"8", b"{}"]


def test_chunks_that_came_meanwhile_are_found(tmp_path: Path) -> None:
    path = write(tmp_path, WALL, 9, is_open=True)
    whole = path.read_bytes()
    cut = ChunkedRecording(path).chunks[4].offset - 9
    path.write_bytes(whole[:cut])
    timeline = Timeline(tmp_path)
    timeline.look_through()
    assert timeline.files()[0].last == (WALL + 3) * NS + NS // 2

    path.write_bytes(whole)

    found = latest(timeline, WALL + 7.2)
    assert found is not None
    assert found.message.payload == b"7"


def test_a_spoiled_index_is_passed_over(tmp_path: Path) -> None:
    path = write(tmp_path, WALL, 9)
    data = bytearray(path.read_bytes())
    data[-200] ^= 0xFF
    path.write_bytes(data)

    assert len(ChunkedRecording(path).chunks) == 10


def test_where_a_clock_was_set_back_both_files_are_found_and_none_follows(
    tmp_path: Path,
) -> None:
    write(tmp_path, WALL, 30)
    write(tmp_path, WALL - 20, 60)
    timeline = Timeline(tmp_path)

    told = [latest(timeline, WALL + at) for at in (-10, 10, 35)]

    assert [one and one.message.payload for one in told] == [b"10", b"10", b"55"]
    assert [timeline.holding((WALL + at) * NS) for at in (-10, 10, 35, 50)] == [
        *(1, 2, 1, 0)
    ]
    assert told[0] is not None
    behind = [one.message.log_time for one in timeline.messages(told[0].behind)]
    assert behind == sorted(behind)
    assert behind[-1] == (WALL + 40) * NS


def test_the_nearest_moments_are_told_on_both_sides(tmp_path: Path) -> None:
    write(tmp_path, WALL, 3)
    write(tmp_path, WALL + 9000, 3)
    timeline = Timeline(tmp_path)

    told = [timeline.around((WALL + at) * NS) for at in (-9, 100, 9999)]

    first, ends, second, last = (NS * (WALL + at) for at in (0, 3, 9000, 9003))
    assert told == [(None, first), (ends, second), (last, None)]
