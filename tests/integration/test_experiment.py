"""The smallest experiment, for real: it dies, is interrupted, and reports."""

import asyncio
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from iveg.adapters.orion import OrionClient
from iveg.lab.experiment.desired_states import read_free_robots
from iveg.lab.experiment.messages import DESCRIPTION, HOPS
from iveg.lab.experiment.plan import ROBOTS
from iveg.settings import Settings
from tests.processes import ROOT, Site, site

pytestmark = pytest.mark.timeout(240)
PLACES = ("IVEG_HOST", "IVEG_PORT", "IVEG_MQTT_URL", "IVEG_ORION_URL", "IVEG_IOTA_URL")
FIWARE = ("IVEG_ORION_URL", "IVEG_IOTA_URL", "IVEG_MQTT_URL")


@contextmanager
def running(out: Path, place: Site, *words: str) -> "Iterator[subprocess.Popen[str]]":
    """``iveg experiment run --minimal`` on the ports of a place."""
    inherited = ("PATH", "HOME", "LANG")
    kept = {name: os.environ[name] for name in inherited if name in os.environ}
    places = {name: place.settings[name] for name in PLACES}
    command = ["experiment", "run", "--minimal", "--out", str(out), *words]
    with subprocess.Popen(
        [sys.executable, "-m", "iveg", *command],
        env={**kept, **places, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def ended(process: "subprocess.Popen[str]") -> tuple[int, str]:
    said, _ = process.communicate(timeout=150.0)
    return process.returncode, said


def read(file: Path) -> Any:
    return json.loads(file.read_text())


def subscriptions(place: Site) -> list[str]:
    """The experiment's own at Orion that are left."""
    tenant = Settings().fiware_service, Settings().fiware_servicepath

    async def read() -> list[str]:
        async with OrionClient(place.settings["IVEG_ORION_URL"], *tenant) as orion:
            told = await orion.read_subscriptions()
        return [one["id"] for one in told if one["description"] == DESCRIPTION]

    return asyncio.run(read())


def test_an_experiment_ends_on_a_named_fiware(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with site(tmp_path) as place:
        place.start("fiware").wait_until_ready()
        named = ["--fiware", *(place.settings[name] for name in FIWARE)]
        with running(out, place, "--keep-raw", *named) as process:
            code, said = ended(process)
        assert code == 0, said
        assert subscriptions(place) == []
        # No robot of the site finds the experiment's STOP at its next start.
        broker = Settings(mqtt_url=place.settings["IVEG_MQTT_URL"])
        asyncio.run(read_free_robots(broker, ROBOTS))

    told = read(out / "result.json")
    assert told["completed"] == {"counted": 1, "timed": 1}
    assert told["planned"] == 1
    assert told["configuration"]["fiware"] == "named"
    person = told["detection"]["farmer"]
    assert person["tp"] + person["fn"] > 0
    hops = {row["data"]: row["hops"] for row in told["latency"]}
    for data in hops:
        up, on, total = (hops[data][hop] for hop in HOPS)
        assert up["count"] == on["count"] == total["count"] > 20
        parts_ms = up["mean_ms"] + on["mean_ms"]
        assert parts_ms == pytest.approx(total["mean_ms"], abs=0.02)
    raw = out / "raw" / "together-1"
    rows = {file.stem: len(file.read_bytes().splitlines()) for file in raw.iterdir()}
    assert rows["truth"] == rows["told"] == rows["encounters"] == 100
    assert rows["messages"] > 60
    assert {one["robot_id"] for one in told["stops"]} == {"AGI", "AGII"}
    assert "Broken off" not in (out / "result.html").read_text()
