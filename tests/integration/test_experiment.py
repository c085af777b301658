"""The smallest experiment, for real."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from iveg.lab.experiment.messages import HOPS
from tests.processes import ROOT

pytestmark = pytest.mark.timeout(240)


def test_the_smallest_experiment_writes_a_report_and_raw_data(tmp_path: Path) -> None:
    out = tmp_path / "out"
    inherited = ("PATH", "HOME", "LANG")
    kept = {name: os.environ[name] for name in inherited if name in os.environ}
    command = ["experiment", "run", "--minimal", "--keep-raw", "--out", str(out)]

    ended = subprocess.run(
        [sys.executable, "-m", "iveg", *command],
        env={**kept, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=150.0,
        check=False,
    )

    assert ended.returncode == 0, ended.stdout
    result = json.loads((out / "result.json").read_text())
    assert result["completed"] == 1
    assert result["planned"] == 1
    person = result["detection"]["farmer"]
    assert person["tp"] + person["fn"] > 0
    hops = {row["data"]: row["hops"] for row in result["latency"]}
    for data in hops:
        up, on, total = (hops[data][hop] for hop in HOPS)
        assert up["count"] == on["count"] == total["count"] > 20
        parts_ms = up["mean_ms"] + on["mean_ms"]
        assert parts_ms == pytest.approx(total["mean_ms"], abs=0.02)
    raw = out / "raw" / "together-1"
    rows = {file.stem: len(file.read_bytes().splitlines()) for file in raw.iterdir()}
    assert rows["truth"] == rows["reported"] == rows["encounters"] == 100
    assert rows["messages"] > 60
    assert "Broken off" not in (out / "result.html").read_text()
