"""How long a question about another rule takes: a day of five robots, with its curve.

    python -m benchmarks.what_if_cost --hours 24 --work 8

Robots drive up and down aisles all day, six people walk among them for ``--work``
hours; each is told as seldom as the history keeps it.  The day is asked about as the
server does it, hour by hour in two processes, with the curve of the threshold.
"""

import argparse
import asyncio
import resource
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import create_engine

from benchmarks.process import machine, print_table
from iveg.adapters.history import tables
from iveg.adapters.history.engine import sqlite_url
from iveg.adapters.history.migrate import upgrade
from iveg.app.what_if import WhatIfs
from iveg.domain.fleet import FleetDescription
from iveg.domain.observations import Instant
from iveg.domain.what_if.parameters import Parameters
from iveg.domain.what_if.questions import VALUES, Question

ROBOTS = tuple(f"R{number}" for number in range(1, 6))
PEOPLE, SEES_M, AISLE_M, EVERY_S = 6, 8.0, 40.0, 0.5
_Floats = NDArray[np.float64]


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--work", type=float, default=8.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        url = sqlite_url(Path(name) / "history.db")
        rows = _fill(url, asked.hours * 3600.0, asked.work * 3600.0)
        took = asyncio.run(_ask(url, asked.hours * 3600.0))
    print(machine())
    cells = (f"{asked.hours:g}", f"{asked.work:g}", *map(str, rows), *took)
    heads = (
        *("hours", "with people", "poses", "detections", "judgements"),
        *("first curve s", "all s", "CPU s"),
    )
    print_table("A question about another rule", heads, [cells])


async def _ask(url: str, seconds: float) -> tuple[str, ...]:
    """Judgements of the range, when its first curve and all was there, CPU (s)."""
    fleet = FleetDescription.undescribed(ROBOTS)
    what_ifs = WhatIfs(url, fleet, lambda: "Q", lambda: Instant(0.0, 0.0))
    rule, values = Parameters(), VALUES["threshold"]
    strict = Parameters(threshold=0.6)
    question = Question(0.0, seconds, rule, strict, "threshold", values)
    began = time.perf_counter()
    job, running = what_ifs.ask(question, "ana"), asyncio.create_task(what_ifs.run())
    first = 0.0
    while not job.is_over:
        await asyncio.sleep(0.05)
        first = first or (time.perf_counter() - began) * bool(job.answer)
    took = time.perf_counter() - began
    running.cancel()
    what_ifs.close()
    if job.answer is None:
        raise SystemExit(f"no answer: {job.why}")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = used.ru_utime + used.ru_stime
    return str(len(question.tried)), f"{first:.1f}", f"{took:.1f}", f"{cpu:.1f}"


def _fill(url: str, seconds: float, work_s: float) -> tuple[int, int]:
    """A history of such a day; numbers of its rows."""
    at = np.arange(0.0, seconds, EVERY_S)
    robots = [_way(at, 0.5, seed) for seed in range(len(ROBOTS))]
    people = [_way(at, 0.2, 100 + seed) for seed in range(PEOPLE)]
    poses = [
        row
        for name, (x, y) in zip(ROBOTS, robots, strict=True)
        for row in _poses(name, at, x, y)
    ]
    seen = [
        row
        for seed, (name, robot) in enumerate(zip(ROBOTS, robots, strict=True))
        for number, person in enumerate(people)
        for row in _seen(name, f"P{number}", at, robot, person, work_s, seed)
    ]
    upgrade(url)
    engine = create_engine(url)
    with engine.begin() as connection:
        for table, rows in ((tables.odometry, poses), (tables.detections, seen)):
            for begin in range(0, len(rows), 20_000):
                connection.execute(table.insert(), rows[begin : begin + 20_000])
    engine.dispose()
    return len(poses), len(seen)


def _way(at: _Floats, speed: float, seed: int) -> tuple[_Floats, _Floats]:
    """Up and down one aisle after the other; x and y (m)."""
    way = at * speed + np.random.default_rng(seed).uniform(0.0, 2 * AISLE_M)
    aisle = (way // AISLE_M * 7 + seed) % 10
    return np.abs(way % (2 * AISLE_M) - AISLE_M), 2.0 * aisle


def _poses(name: str, at: _Floats, x: _Floats, y: _Floats) -> list[dict[str, object]]:
    goes = np.gradient(x, at)
    yaw = np.where(goes > 0.0, 0.0, np.pi)
    # No robot drives quite straight.
    turns = np.random.default_rng(len(name)).normal(0.0, 0.02, len(at))
    columns = np.column_stack((at, x, y, yaw, np.abs(goes), turns)).tolist()
    keys = "at", "x", "y", "yaw", "linear", "angular"
    same = {"robot_id": name, "limit_factor": 1.0}
    return [{**dict(zip(keys, row, strict=True)), **same} for row in columns]


def _seen(
    name: str,
    person: str,
    at: _Floats,
    robot: tuple[_Floats, _Floats],
    where: tuple[_Floats, _Floats],
    work_s: float,
    seed: int,
) -> list[dict[str, object]]:
    """Who is in the same aisle and near, with any confidence."""
    is_near = np.abs(robot[0] - where[0]) < SEES_M
    rows = np.flatnonzero(is_near & (robot[1] == where[1]) & (at < work_s))
    sure = np.random.default_rng(seed).uniform(0.4, 0.95, len(rows))
    columns = np.column_stack((at[rows], where[0][rows], where[1][rows], sure)).tolist()
    return [
        {
            "at": moment,
            "robot_id": name,
            "class_id": "farmer",
            "class_": "person",
            "probability": probability,
            "x": x,
            "y": y,
            "z": 0.9,
            "confident": probability >= 0.8,
            "transport": "direct",
            "person_id": person if probability >= 0.8 else None,
        }
        for moment, x, y, probability in columns
    ]


if __name__ == "__main__":
    main()
