"""What is wanted of each robot outlives crashes, torn lines and full disks."""

import asyncio
import logging
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random
from typing import Literal

import orjson
import pytest

from iveg.adapters.journal import FileJournal
from iveg.domain.stop import DesiredRecord
from tests.builders import START


async def write(path: Path, *lines: tuple[str, str]) -> FileJournal:
    journal = FileJournal(path)
    for robot_id, desired in lines:
        assert desired in ("stopped", "run")
        await journal.log_desired(
            robot_id, "stopped" if desired == "stopped" else "run", "01A", "ana", START
        )
    return journal


async def test_what_was_wanted_last_is_wanted_after_a_restart(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "commands.jsonl"
    journal = await write(
        path, ("AGI", "stopped"), ("AGII", "stopped"), ("AGII", "run")
    )
    journal.close()

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}


async def test_a_line_is_on_disk_when_the_call_returns(tmp_path: Path) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, ("AGI", "stopped"))

    (_, line) = path.read_bytes().splitlines()

    assert orjson.loads(line) == {
        "at": START.wall,
        "robot_id": "AGI",
        "desired": "stopped",
        "hold_id": "01A",
        "by": "ana",
        "named": [],
        "ch": None,
    }
    journal.close()


async def test_the_same_wish_again_adds_no_line_and_another_does(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, *[("AGI", "stopped")] * 100)
    await journal.log_release("AGI", "01A", ["01A"], "c1", "ana", START)
    await journal.log_release("AGI", "01A", ["01A"], "c1", "ben", START)
    await journal.log_desired("AGI", "run", None, "ana", START)
    await journal.log_desired("AGII", "run", None, "ana", START)
    await journal.log_desired("AGI", "stopped", "01A", "ana", START)
    await journal.log_desired("AGI", "stopped", "01B", "ana", START)
    journal.close()

    wishes = [orjson.loads(line) for line in path.read_bytes().splitlines()[1:]]
    assert [(one["robot_id"], one["desired"], one["hold_id"]) for one in wishes] == [
        ("AGI", "stopped", "01A"),
        ("AGI", "stopped", "01A"),
        ("AGI", "run", None),
        ("AGII", "run", None),
        ("AGI", "stopped", "01A"),
        ("AGI", "stopped", "01B"),
    ]


async def test_a_line_that_the_disk_refused_is_written_when_it_is_said_again(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    path.mkdir()
    journal = await write(path, ("AGI", "stopped"))
    path.rmdir()

    await journal.log_desired("AGI", "stopped", "01A", "ana", START)
    journal.close()

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}


async def test_what_a_release_has_named_is_known_and_still_wanted(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, ("AGI", "stopped"))
    await journal.log_release("AGI", "01A", ["01A", "01B"], "c1", "ana", START)
    await journal.log_desired("AGI", "stopped", "01C", "iveg", START)
    journal.close()

    assert FileJournal(path).read() == {
        "AGI": DesiredRecord("iveg", "01C", ("01A", "01B"), ("01A", "01B"), "c1")
    }


async def test_a_release_that_came_true_is_over_but_its_names_stay_known(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, ("AGI", "stopped"))
    await journal.log_release("AGI", "01A", ["01A"], "c1", "ana", START)
    await journal.log_desired("AGI", "run", None, "ana", START)
    await journal.log_desired("AGI", "stopped", "01B", "ben", START)
    journal.close()

    assert FileJournal(path).read() == {
        "AGI": DesiredRecord("ben", "01B", named=("01A",))
    }


async def test_of_the_names_the_last_sixty_four_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, ("AGI", "stopped"))
    for number in range(70):
        await journal.log_release(
            "AGI", "01A", ["01A", f"n{number}"], "c", "ana", START
        )
    journal.close()

    named = FileJournal(path).read()["AGI"].named
    assert len(named) == 64
    assert named[-2:] == ("01A", "n69")


def test_a_hold_that_an_earlier_version_wrote_down_may_have_been_named(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    path.write_bytes(
        b'{"at": 1, "robot_id": "AGI", "desired": "stopped", "hold_id": "01A",'
        b' "by": "ana"}\n'
    )

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", None)}


def test_without_a_file_nothing_is_wanted(tmp_path: Path) -> None:
    assert FileJournal(tmp_path / "none").read() == {}


async def test_a_line_that_a_crash_cut_short_hurts_no_other(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "commands.jsonl"
    (await write(path, ("AGI", "stopped"))).close()
    with path.open("ab") as file:
        file.write(b'{"at": 1, "robot_id": "AGI", "desi')

    (await write(path, ("AGII", "stopped"))).close()

    assert FileJournal(path).read() == {
        "AGI": DesiredRecord("ana", "01A"),
        "AGII": DesiredRecord("ana", "01A"),
    }
    assert "line 3: not readable, skipped" in caplog.text


@pytest.mark.parametrize(
    "line",
    [
        b"7",
        b"[]",
        b"{}",
        b'{"robot_id": "AGI", "by": "x"}',
        b'{"robot_id": "AGI", "by": "x", "desired": "sttoped"}',
        b'{"robot_id": "AGI", "by": "x", "desired": []}',
        b"\xff\x00",
    ],
)
async def test_a_line_that_says_nothing_releases_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, line: bytes
) -> None:
    caplog.set_level(logging.ERROR)
    path = tmp_path / "commands.jsonl"
    (await write(path, ("AGI", "stopped"))).close()
    with path.open("ab") as file:
        file.write(line + b"\n")

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}


async def test_lines_of_many_at_once_are_whole(tmp_path: Path) -> None:
    path = tmp_path / "commands.jsonl"
    journal = FileJournal(path)
    await asyncio.gather(
        *(
            journal.log_desired(f"R{number}", "stopped", "01A", "ana", START)
            for number in range(40)
        )
    )
    journal.close()

    assert len(FileJournal(path).read()) == 40


async def test_a_disk_that_fails_is_logged_and_holds_up_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "taken").write_text("a file where a directory should be")

    await write(tmp_path / "taken" / "commands.jsonl", ("AGI", "stopped"))

    assert "could not be written" in caplog.text


async def _live_long(journal: FileJournal, rnd: Random) -> None:
    """Presses, releases that are named, and resumes, in any order."""
    for number in range(rnd.randrange(1, 60)):
        robot = rnd.choice(("AGI", "AGII"))
        what = rnd.choice(("stopped", "named", "run"))
        ids = [f"n{rnd.randrange(number + 1)}" for _ in range(rnd.randrange(1, 4))]
        if what == "named":
            names = list(dict.fromkeys(ids))
            await journal.log_release(robot, ids[0], names, f"c{number}", "ana", START)
        else:
            hold = None if what == "run" else ids[0]
            desired: Literal["stopped", "run"] = "run" if hold is None else "stopped"
            await journal.log_desired(robot, desired, hold, f"by{number}", START)


@pytest.mark.parametrize("seed", range(40))
async def test_a_compacted_journal_says_what_the_long_one_said(
    tmp_path: Path, seed: int
) -> None:
    path = tmp_path / "commands.jsonl"
    journal = FileJournal(path)
    await _live_long(journal, Random(seed))  # noqa: S311 - repeatable on purpose
    journal.close()

    long = FileJournal(path).read()
    lines = path.read_bytes().splitlines()
    assert FileJournal(path).read() == long
    assert len(lines) <= 1 + 2 * 3

    # A press and a release more say the same on both.
    again = FileJournal(path)
    await again.log_desired("AGI", "stopped", "new", "ben", START)
    again.close()
    assert FileJournal(path).read()["AGI"].hold_id == "new"


async def test_names_of_releases_survive_that_the_journal_is_compacted(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, ("AGI", "stopped"))
    await journal.log_release("AGI", "01A", ["01A"], "c1", "ana", START)
    await journal.log_desired("AGI", "run", None, "ana", START)
    journal.close()
    assert FileJournal(path).read() == {}

    later = FileJournal(path)
    await later.log_desired("AGI", "stopped", "01B", "ben", START)
    later.close()

    assert FileJournal(path).read() == {
        "AGI": DesiredRecord("ben", "01B", named=("01A",))
    }


async def test_a_journal_of_a_newer_iveg_is_believed_and_left_as_it_is(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "commands.jsonl"
    (await write(path, ("AGI", "stopped"), ("AGI", "stopped"))).close()
    newer = path.read_bytes().replace(b'"version":1', b'"version":9', 1)
    path.write_bytes(newer)

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}
    assert path.read_bytes() == newer
    assert "stop-journal 9" in caplog.text


async def test_f64_a_stop_is_on_disk_while_all_other_threads_are_busy(
    tmp_path: Path,
) -> None:
    loop, free = asyncio.get_running_loop(), threading.Event()
    loop.set_default_executor(ThreadPoolExecutor(1))
    busy = loop.run_in_executor(None, free.wait)
    journal = FileJournal(tmp_path / "commands.jsonl")

    async with asyncio.timeout(30):
        await journal.log_desired("AGI", "stopped", "01H", "ana", START)

    assert journal.read()["AGI"].hold_id == "01H"
    free.set()
    await busy
    journal.close()
