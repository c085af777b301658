"""How well people stay who they are: IDF1 and identity switches against the emulator.

Five greenhouses of ten minutes on the virtual clock: two robots, four people, the
demo's detector.  A person counts while some camera has a line of sight to them, and
stays the same one for the whole time, however long they are out of sight.  *Names* are
the ids under which people were known for longer than a glimpse.  Score: py-motmetrics
(IDF1 after Ristani et al. 2016).
"""

import argparse
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import motmetrics
import numpy as np

from iveg.adapters.fleet_files import built_in
from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, Origin, Received
from iveg.domain.tracking.people import People
from iveg.domain.tracking.sight import AllClear
from iveg.domain.world import World
from iveg.lab.emulator.camera import DETECTORS, person_target
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld

ROBOTS = ("AGI", "AGII")
SEEDS = (1, 2, 3, 4, 5)
STEP_S, LOOK_EVERY = 1 / 30, 3
MATCH_M = 1.0
MOST = 0.5
"""Of a person; who is half behind crop may be seen or not."""


@dataclass
class Run:
    """One greenhouse, its people as iVeg knows them, and the score so far."""

    seed: int
    scenario: str
    profile: str

    def __post_init__(self) -> None:
        self.greenhouse: Greenhouse = load_greenhouse("mvsim-20x20")
        layout = lay_out(scenario_named(self.scenario), ROBOTS, self.greenhouse)
        detector = DETECTORS[layout.detector or self.profile]
        self.emulated = SimulatedWorld(self.greenhouse, layout, detector, self.seed)
        self.world, self.rule = World(built_in()), DetectionRule()
        self.people = People(self.greenhouse.bounds)
        self.all_clear = AllClear()
        self.score = motmetrics.MOTAccumulator(auto_id=True)
        self.seq = 0
        self.ids: set[str] = set()
        self.names: set[str] = set()
        self.viewed: dict[int, float] = {}

    def run(self, seconds: float) -> None:
        """Let the greenhouse live so long."""
        for step in range(round(seconds / STEP_S)):
            now = step * STEP_S
            self.emulated.walk(STEP_S)
            for place, rig in enumerate(self.emulated.rigs.values()):
                rig.drive(rig.requested_twist(now, self.emulated))
                rig.move(STEP_S)
                said = replace(rig.odometry(), origin=self._origin(now))
                self.world.apply(Received(said, _at(now)))
                if step % LOOK_EVERY == place % LOOK_EVERY:
                    self._look(rig, now)
            if step % LOOK_EVERY == 0:
                self.all_clear.sweep(self.people, self.world, self.greenhouse, _at(now))
                self.people.forget(_at(now))
                self._judge(now)

    def _look(self, rig: RobotHardware, now: float) -> None:
        frame = rig.detect(now, self.emulated)
        applied = replace(frame, origin=self._origin(now))
        self.world.apply(Received(applied, _at(now)))
        self.people.sight(applied, self.world, self.rule, _at(now), f"d{self.seq}")

    def _origin(self, now: float) -> Origin:
        self.seq += 1
        return Origin("boot", self.seq, None, _at(now).wall)

    def _judge(self, now: float) -> None:
        """One look at truth and at what iVeg shows as seen."""
        viewed = self._in_view(now)
        objects = [
            (number, one.x, one.y)
            for number, one in enumerate(self.emulated.people)
            if number in viewed
        ]
        known = [
            one
            for one in self.people.known.values()
            if one.class_ == "person" and one.stage(_at(now)) == "seen"
        ]
        self.ids |= {one.person_id for one in known}
        self.names |= {one.person_id for one in known if one.is_well_known}
        distances = np.array(
            [
                [
                    _gated(math.hypot(x - one.newest.x, y - one.newest.y))
                    for one in known
                ]
                for _, x, y in objects
            ]
        ).reshape(len(objects), len(known))
        names = [int(one.person_id[1:]) for one in known]
        self.score.update([name for name, _, _ in objects], names, distances)

    def _in_view(self, now: float) -> set[int]:
        """Who is in some camera's field with line of sight, or was a second ago."""
        targets = [
            person_target(n, disc) for n, disc in enumerate(self.emulated.discs())
        ]
        for number, target in enumerate(targets):
            rigs = self.emulated.rigs.values()
            if any(rig.part_seen(target, self.emulated) > MOST for rig in rigs):
                self.viewed[number] = now
        return {n for n, at in self.viewed.items() if now - at <= LIMITS.seen_s}


def _gated(distance: float) -> float:
    return distance if distance <= MATCH_M else math.nan


def _at(now: float) -> Instant:
    return Instant(1000.0 + now, 1.8e9 + now)


def rows(
    seeds: tuple[int, ...], seconds: float, scenario: str, profile: str
) -> Iterator[dict[str, float]]:
    """The score of each seed."""
    metrics = ["idf1", "num_switches", "num_unique_objects", "recall", "precision"]
    for seed in seeds:
        run = Run(seed, scenario, profile)
        run.run(seconds)
        host = motmetrics.metrics.create()
        found = host.compute(run.score, metrics=metrics).iloc[0].to_dict()
        yield {"seed": seed, "ids": len(run.ids), "names": len(run.names), **found}


def main() -> None:
    """Print a line a seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--scenario", default="demo")
    parser.add_argument("--profile", default="simulation")
    options = parser.parse_args()
    for row in rows(SEEDS, options.seconds, options.scenario, options.profile):
        print(json.dumps({key: round(value, 4) for key, value in row.items()}))


if __name__ == "__main__":
    main()
