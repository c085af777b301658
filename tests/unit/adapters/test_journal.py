"""What is wanted of each robot outlives crashes, torn lines and full disks."""

import asyncio
import logging
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from random import Random
from typing import Literal

import orjson
import pytest

from iveg.adapters.journal import FileJournal
from iveg.domain.stop import DesiredRecord
from iveg.vital.record import Waiting
from tests.builders import START
from tests.fakes.disk import files_no_longer_than
from tests.fakes.records import command_event_record, command_record, log_record


async def write(path: Path, *lines: tuple[str, str]) -> FileJournal:
    journal = FileJournal(path)
    for robot_id, desired in lines:
        assert desired in ("stopped", "run")
        await journal.log_desired(
            robot_id, "stopped" if desired == "stopped" else "run", "01A", "ana", START
        )
    return journal


async def test_a_line_is_on_disk_when_the_call_returns(tmp_path: Path) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, ("AGI", "stopped"))

    (_, line) = path.read_bytes().rstrip(b"\0").splitlines()

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
    await journal.log_desired(
        "AGI", "stopped", "01A", "ana", START, named=["01A"], challenge="c1"
    )
    await journal.log_desired(
        "AGI", "stopped", "01A", "ben", START, named=["01A"], challenge="c1"
    )
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
    await journal.log_desired(
        "AGI", "stopped", "01A", "ana", START, named=["01A", "01B"], challenge="c1"
    )
    await journal.log_desired("AGI", "stopped", "01C", "iveg", START)
    journal.close()

    assert FileJournal(path).read() == {
        "AGI": DesiredRecord("iveg", "01C", ("01A", "01B"), ("01A", "01B"), "c1")
    }


def test_a_hold_that_an_earlier_version_wrote_down_may_have_been_named(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    path.write_bytes(
        b'{"at": 1, "robot_id": "AGI", "desired": "stopped", "hold_id": "01A",'
        b' "by": "ana"}\n'
    )

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", None)}


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
            await journal.log_desired(
                robot,
                "stopped",
                ids[0],
                "ana",
                START,
                named=names,
                challenge=f"c{number}",
            )
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
    lines = path.read_bytes().rstrip(b"\0").splitlines()
    assert FileJournal(path).read() == long
    assert len(lines) <= 1 + 2 * 3

    # A press and a release more say the same on both.
    again = FileJournal(path)
    await again.log_desired("AGI", "stopped", "new", "ben", START)
    again.close()
    assert FileJournal(path).read()["AGI"].hold_id == "new"


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


# --- rows of orders ---------------------------------------------------------------


async def keep(journal: FileJournal, *rows: Waiting) -> None:
    for row in rows:
        journal.note(row)
    await journal.flushed()


def left(path: Path) -> list[int]:
    """Revisions of the rows that the next run finds."""
    journal = FileJournal(path)
    journal.read()
    journal.close()
    return [one.revision for one in journal.left()]


async def test_rows_of_orders_outlive_a_crash_beside_what_is_wanted(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, ("AGI", "stopped"))
    rows = Waiting(command_record(), 7, 5.0), Waiting(command_event_record(), 8, 5.0)
    await keep(journal, *rows)

    later = FileJournal(path)
    assert later.read() == {"AGI": DesiredRecord("ana", "01A")}
    assert [(one.record, one.revision) for one in later.left()] == [
        (command_record(), 7),
        (command_event_record(), 8),
    ]


async def test_only_what_the_history_holds_is_compacted_away(tmp_path: Path) -> None:
    path = tmp_path / "commands.jsonl"
    journal = await write(path, ("AGI", "stopped"))
    rows = [Waiting(command_record(reason="r" * 400), n, 0.0) for n in range(1, 800)]
    await keep(journal, *rows)
    grown = len(path.read_bytes().rstrip(b"\0"))

    await journal.committed({one.revision for one in rows[:-1]})

    assert len(path.read_bytes().rstrip(b"\0")) < grown / 100
    assert left(path) == [799]
    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}
    await keep(journal, Waiting(command_record(), 800, 0.0))
    assert left(path) == [799, 800]
    journal.close()


async def test_on_a_full_disk_orders_are_still_written_down(tmp_path: Path) -> None:
    path = tmp_path / "commands.jsonl"
    journal = FileJournal(path)
    journal.read()

    with files_no_longer_than(path.stat().st_size):
        await keep(journal, *(Waiting(command_record(), n, 0.0) for n in range(1, 500)))
        await journal.log_desired("AGI", "stopped", "01A", "ana", START)

    assert len(left(path)) == 499
    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}


async def test_a_write_that_is_cancelled_half_way_is_done_again(
    tmp_path: Path,
) -> None:
    path = tmp_path / "commands.jsonl"
    journal = FileJournal(path)
    journal.note(Waiting(command_record(), 1, 0.0))
    writing = asyncio.create_task(journal.flushed())
    await asyncio.sleep(0)
    writing.cancel()
    await asyncio.wait({writing})

    await journal.flushed()
    journal.close()

    assert left(path) == [1]


async def test_what_an_earlier_version_spilled_is_taken_over_once(
    tmp_path: Path,
) -> None:
    path, spilled = tmp_path / "commands.jsonl", tmp_path / "history.db.journal"
    (await write(path, ("AGI", "stopped"))).close()
    record = asdict(command_record()) | {"drill": False}
    lines = (
        {"kind": "CommandRecord", "revision": 3, "record": record},
        {"kind": "LogRecord", "revision": 4, "record": asdict(log_record())},
    )
    spilled.write_bytes(b"".join(orjson.dumps(one) + b"\n" for one in lines))
    spilled.with_name("history.db.journal-reserve").write_bytes(bytes(10))

    journal = FileJournal(path, spilled)
    assert journal.read() == {"AGI": DesiredRecord("ana", "01A")}
    journal.close()

    assert [one.record for one in journal.left()] == [command_record(), log_record()]
    assert not spilled.exists()
    assert not spilled.with_name("history.db.journal-reserve").exists()
    assert left(path) == [3, 4]
