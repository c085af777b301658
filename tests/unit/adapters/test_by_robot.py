"""What is kept of each robot outlives a restart; a damaged file lifts nothing."""

from pathlib import Path

from pydantic import TypeAdapter

from iveg.adapters.by_robot import FileByRobot
from iveg.domain.detector import OutOfService
from iveg.domain.revocation import Revocation

OUT = {"AGI": OutOfService("ana", 1.5, "boot-a"), "AGII": OutOfService("eva", 2.0)}


def _file(folder: Path) -> FileByRobot[OutOfService]:
    reader = TypeAdapter(tuple[str, OutOfService])
    return FileByRobot(folder / "detectors.jsonl", "detectors", reader)


async def test_what_was_saved_is_there_at_the_next_start(tmp_path: Path) -> None:
    await _file(tmp_path).save(OUT)

    assert _file(tmp_path).load() == OUT


async def test_a_revoked_robot_stays_so(tmp_path: Path) -> None:
    reader = TypeAdapter(tuple[str, Revocation])
    store = FileByRobot(tmp_path / "revoked.jsonl", "revoked", reader)
    word = Revocation("ana", 12.5, stood=False)

    await store.save({"AGI": word})

    assert store.load() == {"AGI": word}


def test_without_a_file_every_detector_is_waited_for(tmp_path: Path) -> None:
    assert _file(tmp_path).load() == {}


def test_a_file_that_cannot_be_read_is_put_aside_and_lifts_nothing(
    tmp_path: Path,
) -> None:
    path = tmp_path / "detectors.jsonl"
    path.write_text('["AGI", {"by": 1}]\n', "utf-8")

    assert _file(tmp_path).load() == {}
    assert (tmp_path / "detectors.jsonl.unreadable").exists()
