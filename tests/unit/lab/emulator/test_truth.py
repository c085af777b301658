"""What is written down is what is in view, whatever the detector makes of it."""

import math
from contextlib import closing
from pathlib import Path

import orjson
import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.truth_files import read_nearest
from iveg.lab.emulator.detector_model import Counts, DetectorModel
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.truth import Driving, TruthLog
from iveg.lab.emulator.world import SimulatedWorld
from iveg.lab.experiment.recording import picture_of_truth, read_truth

BLIND = DetectorModel(0.9, counts={"farmer": Counts(0, 0, 1), "AGI": Counts(0, 0, 1)})


def test_a_person_whom_the_detector_misses_is_in_the_truth(tmp_path: Path) -> None:
    greenhouse = load_greenhouse(scenario_named("together").greenhouse)
    layout = lay_out(scenario_named("together"), ("AGI", "AGII"), greenhouse)
    world = SimulatedWorld(greenhouse, layout, BLIND, seed=1)
    rig = world.rigs["AGI"]

    with closing(TruthLog(tmp_path / "truth.jsonl")) as log:
        told = rig.detect(0.0, world)
        log.record(rig, world, 1000.5, Driving(0.6, 0.5))

    [row] = read_truth(tmp_path / "truth.jsonl")
    picture = picture_of_truth(row)
    [person] = world.discs()
    assert told.detections == ()
    assert (picture.robot_id, picture.at) == ("AGI", 1000.5)
    [seen] = [one for one in picture.seen if one.class_id == "farmer"]
    assert (seen.x, seen.y) == (round(person.x, 3), round(person.y, 3))
    assert seen.local is not None
    assert rig.vehicle.pose.transform(*seen.local) == pytest.approx(
        (person.x, person.y), abs=0.002
    )


def test_everybody_is_in_the_truth_with_the_robot_s_true_pose(tmp_path: Path) -> None:
    greenhouse = load_greenhouse(scenario_named("demo").greenhouse)
    layout = lay_out(scenario_named("demo"), ("AGI", "AGII"), greenhouse)
    world = SimulatedWorld(greenhouse, layout, BLIND, seed=1)

    with closing(TruthLog(tmp_path / "truth.jsonl")) as log:
        log.record(world.rigs["AGI"], world, 1000.5, Driving(0.6, 0.5))

    told = orjson.loads((tmp_path / "truth.jsonl").read_bytes())
    pose = world.rigs["AGI"].vehicle.pose
    assert [one["key"] for one in told["people"]] == [f"person-{n}" for n in range(4)]
    assert [one["x"] for one in told["people"]] == [
        round(one.x, 3) for one in world.discs()
    ]
    assert (told["pose"]["x"], told["speed"]) == (round(pose.x, 3), 0.0)
    assert (told["wanted"], told["factor"]) == (0.6, 0.5)
    # Two rows of crop are between AGI and the picker in the last corridor.
    assert [one["hidden"] for one in told["people"]] == [False, False, True, False]
    assert [one["key"] for one in told["robots"]] == ["AGI", "AGII"]
    assert told["robots"][0] == {"key": "AGI", **told["pose"]}

    # What if: the same file tells how near the nearest of them was.
    nearest = read_nearest(tmp_path / "truth.jsonl", 1000.0, 1001.0)["AGI"]
    away = min(math.hypot(one.x - pose.x, one.y - pose.y) for one in world.discs())
    assert nearest.away == pytest.approx([away], abs=0.002)
