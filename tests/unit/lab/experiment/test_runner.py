"""Experiments started from a page: one at a time, never beside a robot, ends told."""

import asyncio
import os
import signal
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from iveg.domain.errors import ExperimentRefusedError
from iveg.lab.experiment.plan import PLANS, claim, expected_s, read_json, write_json
from iveg.lab.experiment.runner import ExperimentRunner
from iveg.models.experiment import Experiment, Protected
from tests.processes import is_alive

PROGRAM = """
import json, os, pathlib, signal, sys
place = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
told = {"state": "running", "run": "peers-1", "phase": "running", "done": 1, "of": 5,
        "left_s": 80, "why": "", "load": 6.5, "pid": os.getpid()}
def write(**more):
    part = place / "own.part"
    part.write_text(json.dumps({**told, **more}))
    part.replace(place / "progress.json")
def end(*_):
    write(state="broken", why="interrupted")
    sys.exit(1)
signal.signal(signal.SIGTERM, end)
write()
"""
WAITS = PROGRAM + "signal.pause()"
FINISHES = PROGRAM + (
    '(place / "result.html").write_text("<h1>whole</h1>")\n'
    'near = {"slowed": {"in_view": 0.9876}, "encounters": 12, "never_slowed": 1}\n'
    '(place / "result.json").write_text(json.dumps({"protected": near}))\n'
    'write(state="done", run=None, phase=None, done=5, left_s=0)'
)
DIES = PROGRAM + 'sys.exit("iveg: the sky has fallen")'


@asynccontextmanager
async def bench_of(
    place: Path, program: str, is_robot_there: Callable[[], bool] = lambda: False
) -> AsyncIterator[ExperimentRunner]:
    script = place / "program.py"
    script.write_text(program)
    bench = ExperimentRunner(
        place / "experiments", is_robot_there, (sys.executable, str(script))
    )
    try:
        yield bench
    finally:
        await bench.close()


async def until(
    bench: ExperimentRunner, found: Callable[[Experiment], bool]
) -> Experiment:
    async with asyncio.timeout(15):
        while not found(bench.list().items[0]):  # noqa: ASYNC110 - files tell nobody
            await asyncio.sleep(0.02)
    return bench.list().items[0]


async def test_one_that_runs_is_watched_and_its_end_is_told(tmp_path: Path) -> None:
    async with bench_of(tmp_path, FINISHES) as bench:
        begun = bench.start("quick")
        claim(tmp_path / "experiments" / begun.name, PLANS["quick"])
        ended = await until(bench, lambda one: one.state == "done")

    assert (begun.name, begun.state, begun.of) == ("quick-001", "running", 8)
    assert begun.left_s == round(sum(map(expected_s, PLANS["quick"].steps())))
    assert (ended.done, ended.why, ended.report) == (5, "", True)
    assert (begun.profile, begun.seed, begun.load) == (None, None, None)
    assert (ended.profile, ended.seed, ended.load) == ("field", 2026, 6.5)
    assert begun.protected is None
    assert ended.protected == Protected(slowed=0.9876, encounters=12, never_slowed=1)
    assert bench.file("quick-001", "html") is not None


def test_a_result_of_another_version_leaves_protection_out(tmp_path: Path) -> None:
    place = tmp_path / "quick-001"
    place.mkdir()
    bench = ExperimentRunner(tmp_path, lambda: False)
    for written in ({"format": 3}, {"protected": None}):
        write_json(place / "result.json", written)
        [listed] = bench.list().items
        assert listed.protected is None


async def test_two_never_run_at_once(tmp_path: Path) -> None:
    async with bench_of(tmp_path, WAITS) as bench:
        bench.start("quick")
        with pytest.raises(ExperimentRefusedError, match="running"):
            bench.start("full")
        running = await until(bench, lambda one: one.phase == "running")

    assert (running.run, running.done, running.left_s) == ("peers-1", 1, 80)


async def test_none_begins_while_a_robot_is_connected(tmp_path: Path) -> None:
    async with bench_of(tmp_path, WAITS, lambda: True) as bench:
        with pytest.raises(ExperimentRefusedError, match="live_robot"):
            bench.start("quick")

    assert bench.list().refused == "live_robot"
    assert bench.list().items == []


async def test_a_robot_that_connects_ends_what_runs(tmp_path: Path) -> None:
    robots: list[str] = []
    async with bench_of(tmp_path, WAITS, lambda: bool(robots)) as bench:
        bench.start("quick")
        await until(bench, lambda one: one.phase == "running")
        robots.append("AGI")
        ended = await until(bench, lambda one: one.why == "live_robot")

    assert ended.state == "broken"


async def test_an_operator_ends_it_and_the_next_start_goes_on_with_it(
    tmp_path: Path,
) -> None:
    async with bench_of(tmp_path, WAITS) as bench:
        bench.start("quick")
        await until(bench, lambda one: one.phase == "running")
        bench.stop()
        ended = await until(bench, lambda one: one.why == "stopped")
        await until(bench, lambda _: bench.refused is None)
        again = bench.start("quick")

    assert (ended.state, ended.done) == ("broken", 1)
    assert again.name == ended.name


async def test_a_death_is_told_with_its_last_words_and_leaves_a_report(
    tmp_path: Path,
) -> None:
    async with bench_of(tmp_path, DIES) as bench:
        bench.start("quick")
        ended = await until(bench, lambda one: one.state == "broken")

    assert ended.why == "iveg: the sky has fallen (exit code 1)"
    assert ended.report
    partial = read_json(tmp_path / "experiments/quick-001/partial.json")
    assert partial["ended_early"] == ended.why


async def test_a_kill_is_told(tmp_path: Path) -> None:
    progress = tmp_path / "experiments/quick-001/progress.json"
    async with bench_of(tmp_path, WAITS) as bench:
        bench.start("quick")
        await until(bench, lambda one: one.phase == "running")
        os.kill(read_json(progress)["pid"], signal.SIGKILL)
        ended = await until(bench, lambda one: one.state == "broken")

    assert ended.why == "(exit code -9)"


async def test_what_runs_ends_with_iveg(tmp_path: Path) -> None:
    progress = tmp_path / "experiments/quick-001/progress.json"
    async with bench_of(tmp_path, WAITS) as bench:
        bench.start("quick")
        await until(bench, lambda one: one.phase == "running")
        pid = read_json(progress)["pid"]

    assert not is_alive(pid)
    assert bench.list().items[0].why == "interrupted"


async def test_one_that_another_iveg_left_running_is_broken_off(tmp_path: Path) -> None:
    left = tmp_path / "experiments/full-001"
    left.mkdir(parents=True)
    write_json(left / "progress.json", {"state": "running", "done": 3, "of": 25})

    async with bench_of(tmp_path, WAITS) as bench:
        [told] = bench.list().items

    assert (told.state, told.why, told.done) == ("broken", "interrupted", 3)
    assert not told.report
