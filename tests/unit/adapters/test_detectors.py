"""Detectors out of service outlive a restart, and a damaged file lifts nothing."""

from pathlib import Path

from iveg.adapters.detectors import FileDetectors
from iveg.domain.detector import OutOfService

OUT = {"AGI": OutOfService("ana", 1.5, "boot-a"), "AGII": OutOfService("eva", 2.0)}


async def test_what_was_saved_is_there_at_the_next_start(tmp_path: Path) -> None:
    await FileDetectors(tmp_path / "detectors.jsonl").save(OUT)

    assert FileDetectors(tmp_path / "detectors.jsonl").load() == OUT


def test_without_a_file_every_detector_is_waited_for(tmp_path: Path) -> None:
    assert FileDetectors(tmp_path / "detectors.jsonl").load() == {}


def test_a_file_that_cannot_be_read_is_put_aside_and_lifts_nothing(
    tmp_path: Path,
) -> None:
    path = tmp_path / "detectors.jsonl"
    path.write_text('["AGI", {"by": 1}]\n', "utf-8")

    assert FileDetectors(path).load() == {}
    assert (tmp_path / "detectors.jsonl.unreadable").exists()
