"""The times of STOPs that are remembered."""

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder
from iveg.adapters.journal import FileJournal
from iveg.domain.records import CommandEventRecord, CommandRecord
from iveg.models.command import Command
from iveg.web.api import day
from tests.builders import START
from tests.unit.web.desk import WebDesk

T = START.wall


def record(number: int, **fields: object) -> CommandRecord:
    usual: dict[str, object] = {
        "command_id": f"C{number}",
        "robot_id": "AGI",
        "kind": "stop",
        "state": "STANDING",
        "requested_by": "ana",
        "requested_at": T - 100.0 + number,
        "pressed_at": T - 100.0 + number - 0.01 * number,
        "answer_at": {"direct": T - 100.0 + number + 0.02},
        "standstill_ms": 1000.0 * number,
        "standing_at": T - 100.0 + 2 * number,
    }
    return CommandRecord(**(usual | fields))  # type: ignore[arg-type]


ROWS = [
    *(record(number) for number in range(1, 5)),
    record(5, robot_id="AGII", pressed_at=None, standstill_ms=None, standing_at=None),
    record(6),
    record(7, standstill_ms=None, standing_at=None),
]


@pytest.fixture
async def asking(tmp_path: Path) -> AsyncIterator[httpx.AsyncClient]:
    url = f"sqlite:///{tmp_path / 'history.sqlite'}"
    desk = WebDesk()
    recorder = Recorder(url, FileJournal(tmp_path / "commands.jsonl"))
    for row in ROWS:
        recorder.enqueue(row)
    await recorder.close()
    queries = Queries(url)
    desk.app.include_router(
        day.stop_records_router(queries, desk.clock, desk.views.find_command)
    )
    async with desk.browser() as browser:
        yield browser
    queries.close()


async def test_each_step_is_summarised_for_each_robot(
    asking: httpx.AsyncClient,
) -> None:
    answer = (await asking.get("/api/v1/commands/latency")).json()

    agi, agii = answer["robots"]
    assert (agi["robot_id"], agi["stops"]) == ("AGI", 6)
    assert agi["answer"]["direct"]["p50_ms"] == pytest.approx(50.0, abs=0.2)
    assert agi["standing"] == {
        "count": 5,
        "p50_ms": 3000.0,
        "p95_ms": 6000.0,
        "max_ms": 6000.0,
    }
    assert agii["standing"]["count"] == 0
    assert agii["standing"]["p50_ms"] is None


async def test_a_command_of_an_earlier_run_is_found_in_the_history(
    asking: httpx.AsyncClient,
) -> None:
    found = await asking.get("/api/v1/commands/C3")
    missing = await asking.get("/api/v1/commands/C9")

    assert found.json()["times"]["pressed"] is not None
    assert missing.status_code == 404


async def test_a_command_of_this_run_is_told_with_its_steps_while_the_history_answers(
    tmp_path: Path,
) -> None:
    url = f"sqlite:///{tmp_path / 'history.sqlite'}"
    recorder = Recorder(url, FileJournal(tmp_path / "commands.jsonl"))
    recorder.enqueue(record(1, state="RUNNING"))
    recorder.enqueue(
        CommandEventRecord(command_id="C1", robot_id="AGI", at=T, state="UNCONFIRMED")
    )
    await recorder.close()
    desk, queries = WebDesk(), Queries(url)
    followed = Command.from_record(record(1)).model_copy(update={"outcome": None})

    desk.app.include_router(
        day.stop_records_router(queries, desk.clock, lambda *_: followed)
    )
    async with desk.browser() as browser:
        whole = (await browser.get("/api/v1/commands/C1")).json()
        (tmp_path / "history.sqlite").write_bytes(b"no database")
        alone = await browser.get("/api/v1/commands/C1")
    queries.close()

    assert (whole["state"], whole["outcome"]) == ("STANDING", "stood")
    assert [one["state"] for one in whole["steps"]] == ["UNCONFIRMED"]
    assert whole["was_loud"] is True
    assert (alone.status_code, alone.json()["outcome"]) == (200, None)
