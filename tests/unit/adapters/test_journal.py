"""What is wanted of each robot outlives crashes, torn lines and full disks."""

# ruff: noqa: ASYNC240 - nothing else runs on the loop of a test

import asyncio
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
from tests.fakes.records import command_record, log_record


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "commands.jsonl"


async def stopped(path: Path, robot_id: str = "AGI") -> FileJournal:
    """A journal in which a robot is to stand."""
    journal = FileJournal(path)
    await journal.log_desired(robot_id, "stopped", "01A", "ana", START)
    return journal


async def test_the_same_wish_again_adds_no_line_and_another_does(path: Path) -> None:
    news: list[tuple[str, Literal["stopped", "run"], str | None]] = [
        ("AGI", "stopped", "01A"),
        ("AGI", "run", None),
        ("AGII", "run", None),
        ("AGI", "stopped", "01A"),
        ("AGI", "stopped", "01B"),
    ]
    journal = FileJournal(path)
    for robot_id, desired, hold_id in news:
        for author in ("ana", "ben"):
            await journal.log_desired(robot_id, desired, hold_id, author, START)

    # On disk as soon as the calls have returned.
    (_, *lines) = path.read_bytes().rstrip(b"\0").splitlines()
    wishes = [orjson.loads(line) for line in lines]
    told = [(one["robot_id"], one["desired"], one["hold_id"]) for one in wishes]
    assert told == news
    journal.close()


async def test_a_line_that_the_disk_refused_is_written_when_it_is_said_again(
    path: Path,
) -> None:
    path.mkdir()
    journal = await stopped(path)
    path.rmdir()

    await journal.log_desired("AGI", "stopped", "01A", "ana", START)
    journal.close()

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}


async def test_what_a_release_has_named_is_known_and_still_wanted(path: Path) -> None:
    journal = await stopped(path)
    await journal.log_desired(
        "AGI", "stopped", "01A", "ana", START, named=["01A", "01B"], challenge="c1"
    )
    await journal.log_desired("AGI", "stopped", "01C", "iveg", START)
    journal.close()

    assert FileJournal(path).read() == {
        "AGI": DesiredRecord("iveg", "01C", ("01A", "01B"), ("01A", "01B"), "c1")
    }


def test_a_hold_that_an_earlier_version_wrote_down_may_have_been_named(
    path: Path,
) -> None:
    path.write_bytes(
        b'{"at": 1, "robot_id": "AGI", "desired": "stopped", "hold_id": "01A",'
        b' "by": "ana"}\n'
    )

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", None)}


@pytest.mark.parametrize(
    "line",
    [
        b'{"at": 1, "robot_id": "AGI", "desi',
        b"[]",
        b'{"robot_id": "AGI", "by": "x"}',
        b'{"robot_id": "AGI", "by": "x", "desired": "sttoped"}',
        b"\xff\x00",
    ],
)
async def test_a_line_that_was_cut_short_or_says_nothing_hurts_no_other(
    path: Path, line: bytes
) -> None:
    (await stopped(path)).close()
    with path.open("ab") as file:
        file.write(line)
    (await stopped(path, "AGII")).close()

    assert FileJournal(path).read() == {
        "AGI": DesiredRecord("ana", "01A"),
        "AGII": DesiredRecord("ana", "01A"),
    }


async def _live_long(journal: FileJournal, rnd: Random) -> None:
    """Presses, releases that are named, and resumes, in any order."""
    for number in range(rnd.randrange(1, 60)):
        robot = rnd.choice(("AGI", "AGII"))
        what = rnd.choice(("stopped", "named", "run"))
        names = [f"n{one}" for one in {rnd.randrange(number + 1) for _ in range(3)}]
        await journal.log_desired(
            robot,
            "run" if what == "run" else "stopped",
            None if what == "run" else names[0],
            f"by{number}",
            START,
            named=names if what == "named" else (),
            challenge=f"c{number}" if what == "named" else None,
        )


@pytest.mark.parametrize("seed", range(40))
async def test_a_compacted_journal_says_what_the_long_one_said(
    path: Path, seed: int
) -> None:
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
    path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (await stopped(path)).close()
    newer = path.read_bytes().replace(b'"version":1', b'"version":9', 1)
    path.write_bytes(newer)

    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}
    assert path.read_bytes() == newer
    assert "stop-journal 9" in caplog.text


async def test_f64_a_stop_is_on_disk_while_all_other_threads_are_busy(
    path: Path,
) -> None:
    loop, free = asyncio.get_running_loop(), threading.Event()
    loop.set_default_executor(ThreadPoolExecutor(1))
    busy = loop.run_in_executor(None, free.wait)
    journal = FileJournal(path)

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


async def test_only_what_the_history_holds_is_compacted_away(path: Path) -> None:
    journal = await stopped(path)
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


async def test_on_a_full_disk_orders_are_still_written_down(path: Path) -> None:
    journal = FileJournal(path)
    journal.read()

    with files_no_longer_than(path.stat().st_size):
        await keep(journal, *(Waiting(command_record(), n, 0.0) for n in range(1, 500)))
        await journal.log_desired("AGI", "stopped", "01A", "ana", START)

    assert len(left(path)) == 499
    assert FileJournal(path).read() == {"AGI": DesiredRecord("ana", "01A")}


async def test_a_write_that_is_cancelled_half_way_is_done_again(path: Path) -> None:
    journal = FileJournal(path)
    journal.note(Waiting(command_record(), 1, 0.0))
    writing = asyncio.create_task(journal.flushed())
    await asyncio.sleep(0)
    writing.cancel()
    await asyncio.wait({writing})

    await journal.flushed()
    journal.close()

    assert left(path) == [1]


async def test_what_an_earlier_version_spilled_is_taken_over_once(path: Path) -> None:
    spilled = path.with_name("history.db.journal")
    (await stopped(path)).close()
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
