"""Recorded runs: some that the emulator writes on the spot, real ones where found.

The real ones lie beside the repository or where ``IVEG_TEST_RECORDINGS`` says; a clone
that stands alone proves the same facts with the emulator's.
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.observations import LaserScan, Odometry
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import SimulatedWorld

ROBOTS = ("AGI", "AGII")
_SETTING = "IVEG_TEST_RECORDINGS"
_BESIDE = Path(__file__).resolve().parents[2] / "../shared/data"
_REAL = Path(os.environ.get(_SETTING, _BESIDE))
_STEP_S, _EVERY = 0.1, 4


def real_log(name: str) -> Path:
    """The recording of a real robot; skips the test where there is none."""
    file = _REAL / f"{name}.jsonl.gz"
    if not file.exists():
        pytest.skip(f"no {file.name} in {_REAL.resolve()}; {_SETTING} says where it is")
    return file


def emulated_logs(folder: Path, seconds: float = 20.0) -> tuple[Path, ...]:
    """What each robot of the demo records of its first seconds, a file for each."""
    greenhouse = load_greenhouse("mvsim-20x20")
    layout = lay_out(scenario_named("demo"), ROBOTS, greenhouse)
    world = SimulatedWorld(greenhouse, layout, DETECTORS["perfect"], seed=1)
    lines: dict[str, list[str]] = {robot_id: [] for robot_id in ROBOTS}
    for now in _drive(world, seconds):
        for robot_id, rig in world.rigs.items():
            lines[robot_id].append(_odometry(now, rig.odometry()))
            lines[robot_id].append(_scan(now, rig.scan(world)))
    files = tuple(folder / f"{robot_id}.jsonl" for robot_id in ROBOTS)
    for file, said in zip(files, lines.values(), strict=True):
        file.write_text("".join(said), "utf-8")
    return files


def _drive(world: SimulatedWorld, seconds: float) -> Iterator[float]:
    """Everybody moves; pauses for the recorder two and a half times a second."""
    for step in range(round(seconds / _STEP_S)):
        now = step * _STEP_S
        for rig in world.rigs.values():
            rig.drive(rig.requested_twist(now, world))
        for rig in world.rigs.values():
            rig.move(_STEP_S)
        world.walk(_STEP_S)
        if step % _EVERY == 0:
            yield now


def _odometry(now: float, said: Odometry) -> str:
    pose, twist = said.pose, said.twist
    place = {"x": pose.x, "y": pose.y, "yaw": pose.yaw}
    speeds = {"v": twist.linear_x, "w": twist.angular_z}
    return json.dumps({"t": now, "kind": "odom", **place, **speeds}) + "\n"


def _scan(now: float, seen: LaserScan) -> str:
    line = {
        "t": now,
        "kind": "scan",
        "angle_min": seen.angle_min,
        "angle_increment": seen.angle_increment,
        "range_min": seen.range_min,
        "range_max": seen.range_max,
        "ox": seen.mount.x,
        "oy": seen.mount.y,
        "ranges": [round(float(r), 2) if np.isfinite(r) else None for r in seen.ranges],
    }
    return json.dumps(line) + "\n"
