"""Were people protected: the emulator's truth against what robots really did.

On the virtual clock, two robots and four people (scenario ``demo``), the rule as it
stands, by detector profile; the same seed gives the same numbers on any machine.

    python -m benchmarks.protection --profiles field,simulation --seeds 11,12,13
    python -m benchmarks.protection --single-boxes
    python -m benchmarks.protection --no-own-laser   # cameras alone
"""

import argparse
from collections.abc import Iterator
from typing import Any

from benchmarks.process import print_table
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.laser import Plan
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import SimulatedWorld, true_picture
from iveg.lab.experiment.protection import (
    Protection,
    moments_of,
    protection_of,
    total_of,
)
from iveg.lab.experiment.stage import STEP_S, Row, Sensing, Stage, encounter_row
from iveg.lab.experiment.virtual import VirtualPipeline

ROBOTS = ("AGI", "AGII")


def staged(
    profile: str,
    seed: int,
    rule: DetectionRule,
    laser: bool = True,
    own: bool = True,
) -> tuple[Stage, SimulatedWorld, VirtualPipeline]:
    """The demo's greenhouse before its first step."""
    scenario = scenario_named("demo")
    greenhouse = load_greenhouse(scenario.greenhouse)
    layout = lay_out(scenario, ROBOTS, greenhouse)
    iveg = VirtualPipeline(load_fleet(words=ROBOTS), greenhouse, rule)
    world = SimulatedWorld(greenhouse, layout, DETECTORS[profile], seed)
    stage = Stage(
        world,
        iveg.parts,
        iveg.feedback,
        iveg.move,
        iveg.hear,
        Sensing(
            scan_every=2 if laser else 0,
            own_laser=own,
            plan=Plan.from_greenhouse(greenhouse),
        ),
    )
    return stage, world, iveg


def run(
    profile: str,
    seed: int,
    seconds: float,
    rule: DetectionRule,
    laser: bool = True,
    own: bool = True,
) -> Protection:
    """One run of the demo's greenhouse; ``own``: robots read their own lasers."""
    stage, world, iveg = staged(profile, seed, rule, laser, own)
    truth: list[Row] = []
    told: list[Row] = []
    for _ in range(round(seconds / STEP_S)):
        stage.step()
        for robot_id, rig in world.rigs.items():
            robot, now = stage.robots[robot_id], stage.now.mono
            truth.append(true_picture(rig, world, now, robot.wanted, robot.factor))
            told.append(encounter_row(iveg, truth[-1]))
    return protection_of(moments_of(truth, told))


def main() -> None:
    """Print a row for each profile, of all its seeds together."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--profiles", default="field,simulation")
    options.add_argument("--seeds", default="11,12,13")
    options.add_argument("--seconds", type=float, default=600.0)
    options.add_argument("--single-boxes", action="store_true")
    options.add_argument("--no-laser", action="store_true")
    options.add_argument("--no-own-laser", action="store_true")
    options.add_argument("--no-foresight", action="store_true")
    asked = options.parse_args()
    rule = DetectionRule(
        possible_people=not asked.single_boxes, foresight=not asked.no_foresight
    )
    seeds = [int(one) for one in asked.seeds.split(",")]
    rows = []
    for profile in asked.profiles.split(","):
        lasers = not asked.no_laser, not asked.no_own_laser
        runs = (run(profile, n, asked.seconds, rule, *lasers) for n in seeds)
        rows += [[profile, *cell] for cell in cells_of(total_of(runs).row())]
    head = ("detector", "number", "value")
    print_table(f"Protection, seeds {asked.seeds}", head, rows)


def cells_of(numbers: Any, place: str = "") -> Iterator[tuple[str, str]]:
    """Each number with its name, those of groups behind the group's."""
    for name, value in numbers.items():
        if isinstance(value, dict):
            yield from cells_of(value, f"{place}{name} ")
        else:
            yield f"{place}{name}", str(value)


if __name__ == "__main__":
    main()
