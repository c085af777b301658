"""How far it is, for a terminal, for a file of lines, and for the page."""

import io
from pathlib import Path
from typing import Any

import pytest

from iveg.lab.experiment.plan import PlannedRun, expected_s, read_json
from iveg.lab.experiment.progress import Progress

STEPS = [PlannedRun("peers", n, 20.0, n) for n in (1, 2)]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def told(directory: Path) -> Any:
    return read_json(directory / "progress.json")


def test_the_file_says_which_run_it_is_at_and_how_long_it_takes(tmp_path: Path) -> None:
    progress = Progress(tmp_path, STEPS, 3, io.StringIO())

    progress.begin(STEPS[0], "counting", 0.0)
    progress.begin(STEPS[0], "running", 4.0)
    progress.tick(10.0)

    assert told(tmp_path).pop("load") >= 0.0
    assert {key: value for key, value in told(tmp_path).items() if key != "load"} == {
        "state": "running",
        "run": "peers-1",
        "phase": "running",
        "done": 3,
        "of": 5,
        "left_s": round(2 * expected_s(STEPS[0]) - 10.0),
        "why": "",
    }


def test_a_slow_run_makes_the_time_left_longer(tmp_path: Path) -> None:
    progress = Progress(tmp_path, STEPS, 0, io.StringIO())
    expected = expected_s(STEPS[0])

    progress.begin(STEPS[0], "counting", 0.0)
    progress.end(STEPS[0], 3 * expected)

    assert progress.left_s(3 * expected) == pytest.approx(2 * expected)


def test_a_terminal_has_one_line_with_a_bar_and_the_time_left(tmp_path: Path) -> None:
    out = Terminal()
    progress = Progress(tmp_path, STEPS, 2, out)

    progress.begin(STEPS[0], "running", 0.0)

    line = out.getvalue()
    assert line.startswith("\r\x1b[2K[##########----------]  2 of 4  peers-1: real")
    assert line.endswith(" left")
    assert "\n" not in line


def test_without_a_terminal_lines_are_plain(tmp_path: Path) -> None:
    out = io.StringIO()
    progress = Progress(tmp_path, STEPS, 0, out)

    progress.begin(STEPS[0], "counting", 0.0)
    progress.tick(1.0)
    progress.finish("")

    assert out.getvalue().splitlines()[1:] == ["peers-1: virtual clock"]
    assert "\x1b" not in out.getvalue()


@pytest.mark.parametrize(("why", "state"), [("", "done"), ("fiware: died", "broken")])
def test_the_end_says_whether_it_is_whole(tmp_path: Path, why: str, state: str) -> None:
    progress = Progress(tmp_path, STEPS, 0, io.StringIO())

    progress.finish(why)

    assert (told(tmp_path)["state"], told(tmp_path)["why"]) == (state, why)
