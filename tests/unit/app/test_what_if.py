"""Questions about another rule: in line, in pieces, ended, answered from a history."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from iveg.adapters.history.engine import history_url
from iveg.adapters.history.recorder import Recorder, journal_file
from iveg.adapters.worker import Worker
from iveg.app.what_if import MOST_WAITING, WhatIfs, judge_part
from iveg.domain.errors import HopError, UnknownNameError, WhatIfRefusedError
from iveg.domain.what_if.parameters import Parameters
from iveg.domain.what_if.questions import Job, Question
from tests.builders import START, fleet_of
from tests.fakes.clock import FakeClock
from tests.fakes.ids import FakeIds
from tests.unit.domain.test_what_if import Aisle, decided, lasting, ran

WALL = START.wall
RULE = Parameters()
BRAKING = {"AGI": 1.0, "AGII": 1.0}


class InPlace(Worker):
    """Works in the test itself; what it was asked, and what happens with each piece."""

    def __init__(self, happens: Callable[[int], None] = lambda _: None) -> None:
        super().__init__()
        self.asked: list[tuple[float, float]] = []
        self.interrupted = 0
        self._happens = happens

    async def run(self, work: Any, *args: Any, **kwargs: Any) -> Any:
        self.asked.append(args[2:4])
        self._happens(len(self.asked))
        await asyncio.sleep(0)
        return await asyncio.to_thread(work, *args, **kwargs)

    def interrupt(self) -> None:
        self.interrupted += 1


def question(since: float = WALL, until: float = WALL + 165.0) -> Question:
    strict = Parameters(threshold=0.6)
    return Question(since, until, RULE, strict, "radius_m", (0.5, 2.0))


def asking(url: str, worker: Worker) -> WhatIfs:
    fleet = fleet_of("AGI", "AGII")
    return WhatIfs(url, fleet, FakeIds(), FakeClock(), workers=[worker])


async def answered(what_ifs: WhatIfs, job: Job) -> Job:
    """A question that is over, and all before it."""
    running = asyncio.create_task(what_ifs.run())
    await until(lambda: job.is_over)
    running.cancel()
    return job


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(30):
        while not condition():  # noqa: ASYNC110 - no event tells
            await asyncio.sleep(0.01)


@pytest.fixture(scope="module")
def aisle() -> Aisle:
    return ran(2)


@pytest.fixture
async def url(aisle: Aisle, tmp_path: Path) -> str:
    """A history of what happened in the aisle."""
    address = history_url("", tmp_path)
    recorder = Recorder(address, journal_file(address, tmp_path))
    running = asyncio.create_task(recorder.run())
    for record in aisle.desk.sink.records:
        recorder.enqueue(record)
    await recorder.caught_up()
    await until(lambda: recorder.counters["history_waiting"] == 0)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await recorder.close()
    return address


async def test_from_the_history_it_is_what_was_decided(url: str, aisle: Aisle) -> None:
    what_ifs = asking(url, InPlace())
    job = await answered(what_ifs, what_ifs.ask(question(), "ana"))

    assert (job.state, job.progress, job.why) == ("done", 1.0, None)
    answer = job.answer
    assert answer is not None
    in_force, strict, small, plain = answer.outcomes
    was = lasting(decided(aisle.desk))
    assert in_force.encounters["person"] == len(was)
    slowed = answer.recorded.slowed_s["person"]
    assert in_force.slowed_s["person"] == pytest.approx(slowed, rel=0.1)
    assert strict.slowed_s["person"] > 0.0
    assert small.slowed_s["person"] < plain.slowed_s["person"]
    assert answer.poses > 400
    assert answer.seen > 200


async def test_a_range_without_data_says_so(url: str) -> None:
    what_ifs = asking(url, InPlace())
    before = question(WALL - 7200.0, WALL - 3600.0)
    job = await answered(what_ifs, what_ifs.ask(before, "ana"))

    assert (job.state, job.why, job.answer) == ("failed", "no_data", None)


async def test_a_long_range_goes_hour_by_hour_and_can_be_ended(url: str) -> None:
    def happens(piece: int) -> None:
        if piece == 2:
            what_ifs.cancel(job.job_id, "ana")

    worker = InPlace(happens)
    what_ifs = asking(url, worker)
    job = what_ifs.ask(question(WALL - 9000.0, WALL + 900.0), "ana")
    await answered(what_ifs, job)

    assert worker.asked == [
        (WALL - 9000.0, WALL - 5400.0),
        (WALL - 5400.0, WALL - 1800.0),
    ]
    assert (job.state, job.answer) == ("cancelled", None)
    assert worker.interrupted == 1
    assert job.progress == pytest.approx(1 / 3)
    assert what_ifs.cancel(job.job_id, "ana").state == "cancelled"


async def test_two_processes_share_a_long_range_whose_first_curve_comes_early(
    url: str,
) -> None:
    early: list[tuple[str, float, bool]] = []

    def happens(piece: int) -> None:
        if piece == 2:
            early.append((job.state, round(job.progress, 2), job.answer is not None))

    first, second = InPlace(happens), InPlace()
    fleet = fleet_of("AGI", "AGII")
    what_ifs = WhatIfs(url, fleet, FakeIds(), FakeClock(), None, [first, second])
    job = what_ifs.ask(question(WALL - 15_000.0, WALL + 600.0), "ana")
    await answered(what_ifs, job)
    alone = asking(url, InPlace())
    same = await answered(alone, alone.ask(job.asked, "ana"))

    assert first.asked
    assert second.asked
    assert len({*first.asked, *second.asked}) == 5
    assert early[0][0] == "running"
    assert early[0][2]
    assert job.answer == same.answer
    # The memory of the second is let go.
    assert (first.interrupted, second.interrupted) == (0, 1)


async def test_each_person_asks_one_at_a_time_and_the_line_is_short() -> None:
    what_ifs = asking("sqlite:///nowhere", InPlace())
    first = what_ifs.ask(question(), "p0")
    with pytest.raises(WhatIfRefusedError, match="yours"):
        what_ifs.ask(question(), "p0")
    for number in range(1, MOST_WAITING):
        what_ifs.ask(question(), f"p{number}")
    with pytest.raises(WhatIfRefusedError, match="full"):
        what_ifs.ask(question(), "late")
    with pytest.raises(UnknownNameError):
        what_ifs.cancel(first.job_id, "p1")
    what_ifs.cancel(first.job_id, None)

    assert what_ifs.ask(question(), "late").state == "waiting"
    assert what_ifs.newest()[0].by == "late"
    with pytest.raises(UnknownNameError):
        what_ifs.find("none")


async def test_a_file_of_the_truth_that_is_away_fails_the_question(
    url: str, tmp_path: Path
) -> None:
    fleet = fleet_of("AGI", "AGII")
    away = tmp_path / "away"
    what_ifs = WhatIfs(url, fleet, FakeIds(), FakeClock(), away, [InPlace()])
    job = await answered(what_ifs, what_ifs.ask(question(), "ana"))

    assert (job.state, job.why, job.answer) == ("failed", "truth", None)


async def test_a_file_of_something_else_fails_the_question(
    url: str, tmp_path: Path
) -> None:
    """Through the process, whose answer has the part that failed."""
    file = tmp_path / "truth.png"
    file.write_bytes(b"\x89PNG")
    worker = Worker()
    what_ifs = WhatIfs(
        url, fleet_of("AGI", "AGII"), FakeIds(), FakeClock(), file, [worker]
    )
    job = await answered(what_ifs, what_ifs.ask(question(), "ana"))
    worker.close()

    assert (job.state, job.why, job.answer) == ("failed", "truth", None)


async def test_a_process_that_dies_fails_its_question_alone(url: str) -> None:
    def happens(piece: int) -> None:
        if piece == 1:
            raise HopError("worker", "ended")

    what_ifs = asking(url, InPlace(happens))
    lost, next_ = what_ifs.ask(question(), "ana"), what_ifs.ask(question(), "ben")
    await answered(what_ifs, next_)

    assert (lost.state, lost.why) == ("failed", "worker")
    assert next_.state == "done"


def test_recordings_of_other_days_are_no_part_of_it(url: str) -> None:
    alone = judge_part(url, {"AGI": 1.0}, WALL, WALL + 165.0, (RULE,))

    assert alone.seen == 0
    assert alone.outcomes[0].encounters == {}
