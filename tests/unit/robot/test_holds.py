"""The hold set, and the file that keeps it."""

from pathlib import Path

import pytest

from iveg.domain.observations import Hold
from iveg.robot.holds import HoldSet, read_holds, write_holds

STOP = Hold("01A", "iveg", "remote")
BUTTON = Hold("hw-1", "hw", "local")
LINK = Hold("link-1", "link", "auto")
SET = HoldSet((STOP, BUTTON, LINK), ("old-1", "old-2"), ("01J",))


def test_the_last_64_released_ids_are_kept() -> None:
    holds = HoldSet()
    for number in range(100):
        name = f"h{number}"
        holds = holds.latch(Hold(name, "iveg", "remote")).lift([name])
    assert holds.released == tuple(f"h{number}" for number in range(36, 100))


def test_a_file_of_an_older_robot_has_no_joined_stops(tmp_path: Path) -> None:
    file = tmp_path / "AGI.json"
    file.write_bytes(b'{"holds": [], "released": ["01A"]}')
    assert read_holds(file) == HoldSet(released=("01A",))


def test_a_file_gives_back_what_was_written(tmp_path: Path) -> None:
    file = tmp_path / "deep" / "AGI.json"
    write_holds(file, SET)
    assert read_holds(file) == SET
    assert [one.name for one in file.parent.iterdir()] == ["AGI.json"]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00\x00",
        b'{"holds": [{"id": "01A", "source": "iveg"',
        b'{"holds": [{"id": "01A", "source": "x", "ack": "remote"}], "released": []}',
        b'{"holds": []}',
        b"[]",
    ],
)
def test_a_file_that_cannot_be_read_is_not_an_empty_one(
    content: bytes, tmp_path: Path
) -> None:
    file = tmp_path / "AGI.json"
    file.write_bytes(content)
    assert read_holds(file) is None
