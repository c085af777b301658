"""How well people stay who they are: IDF1 and identity switches against the emulator.

Five greenhouses of ten minutes on the virtual clock: two robots, four people, the
demo's detector.  A person counts while some camera has a line of sight to them, and
stays the same one for the whole time, however long they are out of sight.  *Names* are
the ids under which people were known for longer than a glimpse.  Score: py-motmetrics
(IDF1 after Ristani et al. 2016), three times: of everybody; of names alone, without
glimpses (``named_``), as trackers are commonly scored, which tell of nobody before they
are sure; and of people in view for two seconds (``long_``), where who is in view more
shortly counts neither way, nor does who is followed for less and nowhere near one.
``bound`` is the IDF1 without a single confusion: what it lacks is the detector's.
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
from iveg.domain.tracking.person import TrackedPerson
from iveg.domain.tracking.sight import AllClear
from iveg.domain.world import World
from iveg.lab.emulator.detector_model import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.people import SimulatedPerson
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.targets import person_target
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld

ROBOTS = ("AGI", "AGII")
SEEDS = (1, 2, 3, 4, 5)
STEP_S, LOOK_EVERY = 1 / 30, 3
MATCH_M = 1.0
LONG_S = 2.0
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
        self.people = People(self.greenhouse)
        self.all_clear = AllClear()
        self.score = motmetrics.MOTAccumulator(auto_id=True)
        self.named = motmetrics.MOTAccumulator(auto_id=True)
        self.long = motmetrics.MOTAccumulator(auto_id=True)
        self.seq = 0
        self.ids: set[str] = set()
        self.names: set[str] = set()
        self.viewed: dict[int, tuple[float, float]] = {}
        """Of each person in view: since when, and when last."""

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
        self._view(now)
        people = list(enumerate(self.emulated.people))
        known = [
            one
            for one in self.people.known.values()
            if one.class_ == "person" and one.stage(_at(now)) == "seen"
        ]
        self.ids |= {one.person_id for one in known}
        self.names |= {one.person_id for one in known if one.is_well_known}
        in_view = [one for one in people if one[0] in self.viewed]
        _score(self.score, in_view, known)
        _score(self.named, in_view, [one for one in known if one.is_well_known])
        long = [one for one in in_view if now - self.viewed[one[0]][0] >= LONG_S]
        others = [one for one in people if one not in long]
        followed = [
            one
            for one in known
            if (one.followed_s >= LONG_S or _is_near(one, long))
            and not _is_near(one, others)
        ]
        _score(self.long, long, followed)

    def _view(self, now: float) -> None:
        """Note who is in sight of some camera, or was a second ago."""
        targets = [
            person_target(n, disc) for n, disc in enumerate(self.emulated.discs())
        ]
        for number, target in enumerate(targets):
            rigs = self.emulated.rigs.values()
            since, last = self.viewed.get(number, (now, now))
            if any(rig.part_seen(target, self.emulated) > MOST for rig in rigs):
                self.viewed[number] = since, now
            elif now - last > LIMITS.seen_s:
                self.viewed.pop(number, None)


def _score(
    score: motmetrics.MOTAccumulator,
    people: list[tuple[int, SimulatedPerson]],
    known: list[TrackedPerson],
) -> None:
    distances = np.array(
        [[_gated(_apart(person, one)) for one in known] for _, person in people]
    ).reshape(len(people), len(known))
    score.update([n for n, _ in people], [one.number for one in known], distances)


def _apart(person: SimulatedPerson, one: TrackedPerson) -> float:
    return math.hypot(person.x - one.newest.x, person.y - one.newest.y)


def _is_near(one: TrackedPerson, people: list[tuple[int, SimulatedPerson]]) -> bool:
    return any(_apart(person, one) <= MATCH_M for _, person in people)


def _gated(distance: float) -> float:
    return distance if distance <= MATCH_M else math.nan


def _at(now: float) -> Instant:
    return Instant(1000.0 + now, 1.8e9 + now)


def rows(
    seeds: tuple[int, ...], seconds: float, scenario: str, profile: str
) -> Iterator[dict[str, float]]:
    """The score of each seed."""
    for seed in seeds:
        run = Run(seed, scenario, profile)
        run.run(seconds)
        counted: dict[str, float] = {"ids": len(run.ids), "names": len(run.names)}
        found = _found("", run.score) | _found("named_", run.named)
        yield {"seed": seed} | counted | found | _found("long_", run.long)


def _found(name: str, score: motmetrics.MOTAccumulator) -> dict[str, float]:
    counts = ["num_detections", "num_objects", "num_predictions"]
    wanted = ["idf1", "num_switches", "recall", "precision", *counts]
    host = motmetrics.metrics.create()
    found = host.compute(score, metrics=wanted).iloc[0].to_dict()
    right, really, told = (found.pop(one) for one in counts)
    found["bound"] = 2 * right / (really + told)
    return {name + key: value for key, value in found.items()}


def main() -> None:
    """Print a line a seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--scenario", default="demo")
    parser.add_argument("--profile", default="simulation")
    options = parser.parse_args()
    for row in rows(options.seeds, options.seconds, options.scenario, options.profile):
        print(json.dumps({key: round(value, 4) for key, value in row.items()}))


if __name__ == "__main__":
    main()
