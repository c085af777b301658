"""The smallest experiment, for real: every program, one scenario, a report."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.processes import ROOT, Site

pytestmark = pytest.mark.timeout(180)
PLACES = ("IVEG_HOST", "IVEG_PORT", "IVEG_MQTT_URL", "IVEG_ORION_URL", "IVEG_IOTA_URL")


def run(out: Path) -> "subprocess.CompletedProcess[str]":
    """``iveg experiment run --minimal`` on ports of its own."""
    inherited = ("PATH", "HOME", "LANG")
    kept = {name: os.environ[name] for name in inherited if name in os.environ}
    places = {name: Site(out.parent).settings[name] for name in PLACES}
    return subprocess.run(
        [sys.executable, "-m", "iveg", "experiment", "run", "--minimal", "--out", out],
        env={**kept, **places, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=150.0,
        check=False,
    )


def test_a_minimal_experiment_scores_what_came_through_the_whole_stack(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"

    done = run(out)

    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads((out / "result.json").read_text())
    assert told["completion"] == {"runs": 1, "completed": 1, "planned": 1}
    person = told["detection"]["farmer"]
    assert person["tp"] + person["fn"] > 0
    hops = {row["data"]: row["hops"] for row in told["latency"]["rows"]}
    assert all(hops[data]["robot_orion"]["count"] > 20 for data in hops)
    assert {one["robot_id"] for one in told["stops"]} == {"AGI", "AGII"}
    assert "Broken off" not in (out / "result.html").read_text()
