"""What is kept of each robot outlives a restart; a damaged file lifts nothing."""

from pathlib import Path

from pydantic import TypeAdapter

from iveg.adapters.files import FileByRobot
from iveg.domain.detector import OutOfService

OUT = {"AGI": OutOfService("ana", 1.5, "boot-a"), "AGII": OutOfService("eva", 2.0)}


def _file(folder: Path) -> FileByRobot[OutOfService]:
    reader = TypeAdapter(tuple[str, OutOfService])
    return FileByRobot(folder / "detectors.jsonl", "detectors", reader)


async def test_what_was_saved_is_there_at_the_next_start(tmp_path: Path) -> None:
    await _file(tmp_path).save(OUT)

    assert _file(tmp_path).load() == OUT


def test_a_file_that_cannot_be_read_is_put_aside_and_lifts_nothing(
    tmp_path: Path,
) -> None:
    path = tmp_path / "detectors.jsonl"
    path.write_text('["AGI", {"by": 1}]\n', "utf-8")

    assert _file(tmp_path).load() == {}
    assert (tmp_path / "detectors.jsonl.unreadable").exists()
