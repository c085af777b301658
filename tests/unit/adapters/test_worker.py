"""Long work runs in a process of its own, which may die and is made anew."""

import asyncio
import os
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from iveg.adapters.worker import MOST_WAITING, Worker
from iveg.domain.errors import HopError
from tests.processes import is_alive, until


def process_id() -> int:
    return os.getpid()


def place_in_line() -> int:
    return int(Path("/proc/self/oom_score_adj").read_text())


def die() -> None:
    os._exit(1)


def fail() -> None:
    raise HopError("database", "locked")


def stumble() -> object:
    return lambda: None  # No other process can be sent this.


@pytest.fixture
def failures() -> list[Exception]:
    return []


@pytest.fixture
async def worker(failures: list[Exception]) -> AsyncIterator[Worker]:
    worker = Worker(failures.append)
    yield worker
    worker.close()


@pytest.mark.skipif(sys.platform != "linux", reason="Linux has such a place")
async def test_where_memory_runs_out_a_worker_goes_before_the_server(
    worker: Worker,
) -> None:
    assert await worker.run(place_in_line) == 1000 > place_in_line()


async def test_a_worker_that_died_is_made_anew_and_ends_with_the_server(
    worker: Worker, failures: list[Exception]
) -> None:
    first = await worker.run(process_id)
    with pytest.raises(HopError, match="worker"):
        await worker.run(die)
    with pytest.raises(HopError, match="lambda"):
        await worker.run(stumble)
    with pytest.raises(HopError, match="database: locked"):
        await worker.run(fail)
    second = await worker.run(process_id)

    worker.close()

    assert len({first, second, os.getpid()}) == 3
    assert len(failures) == 2
    until(lambda: not is_alive(second), "the worker ends", 10.0)


async def test_more_than_can_wait_is_refused(worker: Worker) -> None:
    asked = [asyncio.create_task(worker.run(process_id)) for _ in range(MOST_WAITING)]
    await asyncio.sleep(0)

    with pytest.raises(HopError, match="too much"):
        await worker.run(process_id)

    assert len({await one for one in asked}) == 1
