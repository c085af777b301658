"""The smallest experiment, for real: it dies, is interrupted, goes on, and reports."""

import asyncio
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from iveg.adapters.orion import OrionClient
from iveg.lab.experiment.desired_states import read_free_robots
from iveg.lab.experiment.message_recorder import DESCRIPTION
from iveg.lab.experiment.plan import ROBOTS
from iveg.lab.experiment.slices import HOPS
from iveg.settings import Settings
from tests.processes import ROOT, Site, children_of, is_alive, site, until
from tests.recounting import recounted, reported

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


def reaches(out: Path, phase: str) -> None:
    """Wait until it is there."""
    file = out / "progress.json"

    def is_there() -> bool:
        told = read(file) if file.exists() else {}
        return (told.get("state"), told.get("phase")) == ("running", phase)

    until(is_there, phase)


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


def is_word(pid: int, word: bytes) -> bool:
    return b"\0" + word + b"\0" in Path(f"/proc/{pid}/cmdline").read_bytes()


def test_an_experiment_survives_a_death_and_ctrl_c_and_ends_on_a_named_fiware(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    with running(out, Site(tmp_path)) as process:
        reaches(out, "counting")
        parts = children_of(process.pid)
        [fiware] = [pid for pid in parts if is_word(pid, b"fiware")]
        os.kill(fiware, signal.SIGKILL)
        code, said = ended(process)
    assert code == 1, said
    assert "fiware: has ended (exit code -9)" in said
    assert read(out / "partial.json")["ended_early"].startswith("fiware: has ended")
    assert "Broken off: fiware" in (out / "partial.html").read_text()
    assert not [pid for pid in parts if is_alive(pid)]

    with running(out, Site(tmp_path)) as process:
        reaches(out, "counting")
        process.send_signal(signal.SIGINT)
        code, said = ended(process)
    assert code == 1, said
    assert read(out / "partial.json")["ended_early"] == "interrupted"

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
    assert told["completion"] == {"runs": 1, "completed": 1, "planned": 1}
    assert told["configuration"]["fiware"] == "named"
    assert told["stack"]["completion"]["completed"] == 1
    person = told["stack"]["detection"]["farmer"]
    assert person["tp"] + person["fn"] > 0
    hops = {row["data"]: row["hops"] for row in told["latency"]["rows"]}
    for data in hops:
        up, on, total = (hops[data][hop] for hop in HOPS[:3])
        assert up["count"] == on["count"] == total["count"] > 20
        parts_ms = up["mean_ms"] + on["mean_ms"]
        assert parts_ms == pytest.approx(total["mean_ms"], abs=0.02)
    assert recounted(out) == reported(told)
    assert {one["robot_id"] for one in told["stack"]["stops"]} == {"AGI", "AGII"}
    assert "Broken off" not in (out / "result.html").read_text()
    assert not list(out.glob("partial.*"))
