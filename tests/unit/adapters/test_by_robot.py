"""What is kept of each robot outlives a restart; a damaged file lifts nothing."""

from pathlib import Path

from pydantic import TypeAdapter

from iveg.adapters.files import FileByRobot
from iveg.domain.detector import OutOfService

OUT = {"AGI": OutOfService("ana", 1.5, "boot-a"), "AGII": OutOfService("eva", 2.0)}


def _file(folder: Path) -> FileByRobot[OutOfService]:
    reader = TypeAdapter(tuple[str, OutOfService])
    return FileByRobot(folder / "detectors.jsonl", "detectors", reader)


async def test_what_was_saved_is_there_and_an_unreadable_file_is_put_aside(
    tmp_path: Path,
) -> None:
    await _file(tmp_path).save(OUT)
    assert _file(tmp_path).load() == OUT
    (tmp_path / "detectors.jsonl").write_text('["AGI", {"by": 1}]\n', "utf-8")

    assert _file(tmp_path).load() == {}
    assert (tmp_path / "detectors.jsonl.unreadable").exists()
