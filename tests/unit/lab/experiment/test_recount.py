"""Who has the raw data can recount the report, to the last digit."""

import asyncio
import random
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.lab.experiment.message_times import MessageTimes
from iveg.lab.experiment.observer import ObservedRun
from iveg.lab.experiment.outcome import half_of, outcome_of, result_of, stack_of
from iveg.lab.experiment.plan import PLANS, PlannedRun
from iveg.lab.experiment.raw import write_raw
from iveg.lab.experiment.slices import Bins
from iveg.lab.experiment.virtual_run import VirtualRun
from tests.recounting import recounted, reported

CHOSEN = {"fiware": "embedded", "confidence_threshold": 0.8}
SECONDS = 8.0


def messages(seed: int) -> list[MessageTimes]:
    """Some lost, some late, some first at Orion, some without a stamp."""
    chance = random.Random(seed)  # noqa: S311 - a test
    return [
        MessageTimes(
            chance.choice(("AGI", "AGII")),
            chance.choice(("odometry", "detections", "lidar")),
            "b",
            seq,
            None if seq % 50 == 0 else (at := SECONDS * seq / 900),
            at + chance.expovariate(80.0),
            None if chance.random() < 0.03 else at + chance.expovariate(25.0),
        )
        for seq in range(1, 900)
        if (at := SECONDS * seq / 900)
    ]


async def run(directory: Path, step: PlannedRun) -> Any:
    """One run whose real half is played, too."""
    rule = DetectionRule()
    virtual = await VirtualRun(step, rule).play(SECONDS)
    if not step.is_timed:
        outcome = outcome_of(step, half_of(virtual), None, (0.5, 0.5))
        write_raw(directory / "raw" / step.name, outcome, virtual, None, CHOSEN)
        return outcome
    told = await VirtualRun(replace(step, profile="simulation"), rule).play(SECONDS)
    decided: Bins = {"edges_ms": [4.0, 40.0], "counts": [70, 9], "total_ms": 512.3}
    real = ObservedRun(
        told.truth,
        told.reported[7:],
        beliefs=told.beliefs,
        decisions=told.decisions,
        completed=step.number == 1,
        slices=[{"lidar": {"iveg": decided}}, {}],
        edges=[1.0, SECONDS / 2, SECONDS],
        settled=step.number == 2,
        read={"passed": 1000, "skipped": 377},
        times=[one for one in messages(step.seed) if 1.0 <= one.broker < SECONDS],
        stops=[
            {
                "robot_id": "AGI",
                "answer": {"direct": {"p50_ms": 12.34}},
                "standing": {"p50_ms": None},
            }
        ],
    )
    outcome = outcome_of(step, half_of(virtual), stack_of(real), (1.26, 3.0))
    write_raw(directory / "raw" / step.name, outcome, virtual, real, CHOSEN)
    return outcome


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """Raw data and result of two runs, two for protection, and two field tests."""
    directory = tmp_path_factory.mktemp("experiment")
    steps = [
        PlannedRun("together", 1, 6.0, 7),
        PlannedRun("nlos", 2, 6.0, 8),
        PlannedRun("demo", 1, 0.0, 9, profile="simulation"),
        PlannedRun("demo", 1, 0.0, 9, profile="simulation", rule="paper"),
        PlannedRun("nlos-field", 1, 0.0, 10, fails=True),
        PlannedRun("nlos-field", 2, 0.0, 11, fails=True),
    ]
    outcomes = [asyncio.run(run(directory, step)) for step in steps]
    return directory, result_of(PLANS["quick"], outcomes, CHOSEN)


def test_the_script_gives_the_reports_tables_to_the_last_digit(
    experiment: tuple[Path, Any],
) -> None:
    directory, result = experiment

    expected = reported(result)

    assert recounted(directory) == expected
    assert len(expected) == 60


@pytest.mark.parametrize(
    ("file", "table"),
    [
        ("virtual/told.ndjson", "detection"),
        ("virtual/truth.ndjson", "place"),
        ("real/costmap.ndjson", "sight"),
        ("virtual/decisions.ndjson", "sight"),
        ("virtual/truth.ndjson", "protection"),
        ("real/truth.ndjson", "protection"),
        ("virtual/encounters.ndjson", "entries"),
        ("real/messages.ndjson", "latency"),
        ("real/hops.ndjson", "latency"),
    ],
)
def test_a_table_is_made_of_the_rows_that_it_is_of(
    experiment: tuple[Path, Any], tmp_path: Path, file: str, table: str
) -> None:
    directory, result = experiment
    copied = tmp_path / "copied"
    shutil.copytree(directory, copied)
    for rows in copied.glob(f"raw/*/{file}"):
        lines = rows.read_text().splitlines(keepends=True)
        rows.write_text("".join(lines[: len(lines) // 2]))

    changed = set(recounted(copied)) - set(reported(result))

    assert any(one.startswith(table) for one in changed)
