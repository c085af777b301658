"""Were people protected: the emulator's truth against what robots really did.

On the virtual clock, two robots and four people (scenario ``demo``), the rule as it
stands, by detector profile; the same seed gives the same numbers on any machine.

    python -m benchmarks.protection --profiles field,simulation --seeds 11,12,13
    python -m benchmarks.protection --single-boxes
"""

import argparse
from collections.abc import Iterator
from math import hypot

from benchmarks.process import print_table
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.app.virtual import VirtualPipeline
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.witness import Plan
from iveg.lab.emulator.camera import DETECTORS, PERSON
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.truth import in_view
from iveg.lab.emulator.world import SimulatedWorld
from iveg.lab.experiment.protection import (
    Moment,
    NearPerson,
    ProtectionScore,
    whole,
)
from iveg.lab.experiment.stage import STEP_S, Stage

ROBOTS = ("AGI", "AGII")


def staged(
    profile: str, seed: int, rule: DetectionRule, laser: bool = True
) -> tuple[Stage, SimulatedWorld, VirtualPipeline]:
    """The demo's greenhouse before its first step."""
    scenario = scenario_named("demo")
    greenhouse = load_greenhouse(scenario.greenhouse)
    layout = lay_out(scenario, ROBOTS, greenhouse)
    iveg = VirtualPipeline(load_fleet(words=ROBOTS), greenhouse, rule)
    world = SimulatedWorld(greenhouse, layout, DETECTORS[profile], seed)
    parts = iveg.parts
    stage = Stage(
        world,
        (),
        parts.ingest,
        parts.loop,
        iveg.feedback,
        iveg.move,
        iveg.hear,
        scan_every=2 if laser else 0,
        plan=Plan.of(greenhouse),
    )
    return stage, world, iveg


def run(
    profile: str, seed: int, seconds: float, rule: DetectionRule, laser: bool = True
) -> ProtectionScore:
    """One run of the demo's greenhouse."""
    stage, world, _ = staged(profile, seed, rule, laser)
    score = ProtectionScore(STEP_S)
    for _ in range(round(seconds / STEP_S)):
        stage.step()
        for moment in moments_of(stage, world):
            score.add(moment)
    return score


def moments_of(stage: Stage, world: SimulatedWorld) -> Iterator[Moment]:
    """Every robot as it really is now."""
    seen = {
        target.key
        for rig in world.rigs.values()
        for target, _ in in_view(rig, world)
        if target.class_id == PERSON
    }
    for robot_id, rig in world.rigs.items():
        pose, robot = rig.vehicle.pose, stage.robots[robot_id]
        people = tuple(
            NearPerson(
                f"person-{number}",
                hypot(one.x - pose.x, one.y - pose.y),
                f"person-{number}" in seen,
            )
            for number, one in enumerate(world.discs())
        )
        at = stage.now.mono
        yield Moment(robot_id, at, robot.speed, robot.wanted, robot.factor, people)


def main() -> None:
    """Print a row for each profile, of all its seeds together."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--profiles", default="field,simulation")
    options.add_argument("--seeds", default="11,12,13")
    options.add_argument("--seconds", type=float, default=600.0)
    options.add_argument("--single-boxes", action="store_true")
    options.add_argument("--no-laser", action="store_true")
    options.add_argument("--no-foresight", action="store_true")
    asked = options.parse_args()
    rule = DetectionRule(
        possible_people=not asked.single_boxes, foresight=not asked.no_foresight
    )
    rows = []
    for profile in asked.profiles.split(","):
        seeds = [int(one) for one in asked.seeds.split(",")]
        row = whole(
            run(profile, one, asked.seconds, rule, not asked.no_laser) for one in seeds
        ).row()
        rows.append(
            [profile, *("–" if one is None else f"{one:g}" for one in row.values())]
        )
    print_table(f"Protection, seeds {asked.seeds}", ["profile", *row], rows)


if __name__ == "__main__":
    main()
