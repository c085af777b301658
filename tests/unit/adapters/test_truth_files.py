"""The emulator's truth, read back for what another rule would have missed."""

from pathlib import Path

import orjson
import pytest

from iveg.adapters.truth_files import read_nearest
from iveg.domain.errors import DataFileError


def row(at: float, robot: str, away: float | None) -> bytes:
    people = [] if away is None else [{"key": "person-0", "x": 1.0 + away, "y": 2.0}]
    pose = {"x": 1.0, "y": 2.0, "yaw": 0.0}
    return orjson.dumps(
        {"robot": robot, "at": at, "pose": pose, "visible": [], "people": people}
    )


def test_of_an_hour_the_seconds_that_are_asked_for_are_read(tmp_path: Path) -> None:
    file = tmp_path / "truth.ndjson"
    lines = [
        row(1000.0 + step / 30, robot, step / 30)
        for step in range(3600)
        for robot in ("AGI", "AGII")
    ]
    file.write_bytes(b"\n".join([*lines, b'{"robot":"AGI","at":1090.0,"po']))

    found = read_nearest(file, 1060.0, 1070.0)

    assert set(found) == {"AGI", "AGII"}
    at, away = found["AGI"].at, found["AGI"].away
    assert 1060.0 <= at[0] < 1060.1
    assert 1069.8 < at[-1] < 1070.0
    assert away == pytest.approx(at - 1000.0)
    # Five times a second are enough for a rule that looks as often.
    assert 45 <= len(at) <= 70


def test_nobody_is_infinitely_far_and_no_row_is_nothing(tmp_path: Path) -> None:
    file = tmp_path / "truth.ndjson"
    file.write_bytes(
        b"\n".join([row(1.0, "AGI", None), b'{"robot":"AGII","at":1.0}', b"rubbish"])
    )

    found = read_nearest(file, 0.0, 10.0)

    assert {name: list(one.away) for name, one in found.items()} == {
        "AGI": [float("inf")]
    }


def test_a_file_that_is_away_is_one_error(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match="cannot be read"):
        read_nearest(tmp_path / "none", 0.0, 1.0)


@pytest.mark.parametrize(
    "content",
    [b"\x89PNG\r\n\x1a\n", b"pose,people\n1,2\n", b'{"robot":"AGI","at":-.-}'],
)
def test_a_file_of_something_else_is_not_a_truth_without_people(
    tmp_path: Path, content: bytes
) -> None:
    file = tmp_path / "truth.ndjson"
    file.write_bytes(content)

    with pytest.raises(DataFileError, match="no line of the truth"):
        read_nearest(file, 0.0, 1.0)


def test_a_file_that_was_just_begun_is_empty_and_no_error(tmp_path: Path) -> None:
    file = tmp_path / "truth.ndjson"
    file.write_bytes(b"")

    assert read_nearest(file, 0.0, 1.0) == {}
