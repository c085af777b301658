"""How sure is what is foretold: predicted places and encounters against the truth.

On the virtual clock, two robots and four people (scenario ``demo``): where iVeg says
that robots and people will be, and where they really were then; and of the encounters
with people that it foretold, how many came true, and when.

    python -m benchmarks.foresight --profile field --seeds 21,22,23
"""

import argparse
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping

import numpy as np

from benchmarks.process import percentile, print_table
from benchmarks.protection import staged
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.observations import Instant
from iveg.domain.rule.foresight import path_of
from iveg.domain.rule.paths import AHEAD_S, HORIZON_S, MOVES_M_S
from iveg.lab.emulator.world import SimulatedWorld
from iveg.lab.experiment.protection import NEAR_M
from iveg.lab.experiment.stage import STEP_S
from iveg.lab.experiment.virtual import VirtualPipeline

HORIZONS_S = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
_EVERY = 4
"""Steps between two looks, as often as iVeg has them."""
_SAME_M = 1.0
"""Who is farther from where iVeg has somebody is somebody else."""
_WAITS = round(2 * HORIZON_S / STEP_S)
"""Steps: a robot that slows for an encounter takes up to twice as long."""
Place = tuple[float, float]
Places = Mapping[str, Place]
Forecast = tuple[int, str, str, float, Place]
"""At which step, of whom, "robot" or "person", for how soon (s), where."""
Meeting = tuple[int, str, str, float]
"""Foretold at which step, of which robot, with whom, in how many seconds."""


def places_in(world: SimulatedWorld) -> Places:
    """Where everybody really is."""
    people = enumerate(world.discs())
    places = {f"person-{n}": (one.x, one.y) for n, one in people}
    for name, rig in world.rigs.items():
        places[name] = rig.vehicle.pose.x, rig.vehicle.pose.y
    return places


def person_at(places: Places, x: float, y: float) -> str | None:
    """Who of the people really is there."""
    away = {
        name: math.dist(place, (x, y))
        for name, place in places.items()
        if name.startswith("person-")
    }
    nearest = min(away, key=lambda one: away[one])
    return nearest if away[nearest] <= _SAME_M else None


def forecasts(
    iveg: VirtualPipeline, step: int, places: Places, now: Instant
) -> Iterator[Forecast]:
    """Where iVeg has everybody go whom it sees."""
    evaluator = iveg.parts.evaluator
    for robot in iveg.parts.core.world.robots.values():
        odometry = robot.odometry
        if odometry and abs(odometry.twist.linear_x) >= MOVES_M_S:
            x, y = path_of(robot, now)
            for ahead in HORIZONS_S:
                there = (
                    float(np.interp(ahead, AHEAD_S, x)),
                    float(np.interp(ahead, AHEAD_S, y)),
                )
                yield step, robot.robot_id, "robot", ahead, there
    for person in evaluator.people.known.values():
        look, age = person.newest, person.age_s(now)
        name = person_at(places, look.x, look.y)
        if person.stage(now) != "seen" or name is None or person.class_ != "person":
            continue
        for ahead in HORIZONS_S:
            on = age + ahead
            there = look.x + look.vx * on, look.y + look.vy * on
            yield step, name, "person", ahead, there


def meetings(
    iveg: VirtualPipeline, step: int, places: Places, now: Instant
) -> Iterator[Meeting]:
    """The encounters with people that were foretold just now."""
    for robot_id in iveg.parts.core.world.robots:
        for one in iveg.parts.evaluator.encounters(robot_id, now):
            name = person_at(places, one.zone.x, one.zone.y)
            apart = 0.0 if name is None else math.dist(places[name], places[robot_id])
            is_new = one.at == now.mono and one.zone.reason == "person"
            if is_new and name is not None and apart > NEAR_M:
                yield step, robot_id, name, one.in_s


def met_after(truth: list[Places], meeting: Meeting) -> float:
    """When two really come within two metres (s); infinite: not soon."""
    step, one, other, _ = meeting
    for later in range(step, min(step + _WAITS, len(truth))):
        if math.dist(truth[later][one], truth[later][other]) <= NEAR_M:
            return (later - step) * STEP_S
    return math.inf


def run(
    profile: str, seed: int, seconds: float, rule: DetectionRule
) -> tuple[list[Places], list[Forecast], list[Meeting]]:
    """One run of the demo's greenhouse."""
    stage, world, iveg = staged(profile, seed, rule)
    truth: list[Places] = []
    told: list[Forecast] = []
    met: list[Meeting] = []
    for step in range(round(seconds / STEP_S)):
        stage.step()
        places = places_in(world)
        truth.append(places)
        met += meetings(iveg, step, places, stage.now)
        if step % _EVERY == 0:
            told += forecasts(iveg, step, places, stage.now)
    return truth, told, met


def main() -> None:
    """Print the errors of places by horizon, and what became of encounters."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--profile", default="field")
    options.add_argument("--seeds", default="21,22,23")
    options.add_argument("--seconds", type=float, default=600.0)
    options.add_argument("--no-foresight", action="store_true")
    asked = options.parse_args()
    rule = DetectionRule(foresight=not asked.no_foresight)
    errors: dict[tuple[float, str], list[float]] = defaultdict(list)
    late: dict[float, list[float]] = defaultdict(list)
    for seed in asked.seeds.split(","):
        truth, told, met = run(asked.profile, int(seed), asked.seconds, rule)
        for step, name, kind, ahead, there in told:
            then = step + round(ahead / STEP_S)
            if then < len(truth):
                errors[ahead, kind].append(math.dist(truth[then][name], there))
        for one in met:
            if one[0] + _WAITS < len(truth):
                to = min(HORIZONS_S, key=lambda lead: abs(lead - one[3]))
                late[to].append(met_after(truth, one) - one[3])
    title = f"{asked.profile}, seeds {asked.seeds}"
    rows = [
        [f"{ahead:g} s"]
        + [
            f"{percentile(sorted(errors[ahead, kind]), share):.2f} m"
            for kind in ("robot", "person")
            for share in (0.5, 0.95)
        ]
        for ahead in HORIZONS_S
    ]
    print_table(
        f"Error of predicted places, {title}",
        ["ahead", "robot P50", "P95", "person P50", "P95"],
        rows,
    )
    print_table(
        f"Encounters that came true, {title}",
        ["foretold", "count", "came", "within 0.5 s", "P5", "P50", "P95 of the error"],
        [[f"{lead:g} s", *_became(late[lead])] for lead in HORIZONS_S if late[lead]],
    )


def _became(late: list[float]) -> list[str]:
    """Count, shares, and by how much those that came were later than foretold (s)."""
    came = sorted(one for one in late if math.isfinite(one))
    near = sum(abs(one) <= 0.5 for one in came)
    shares = [f"{len(came) / len(late):.0%}", f"{near / len(late):.0%}"]
    spread = [f"{percentile(came, one):+.2f} s" for one in (0.05, 0.5, 0.95)]
    return [str(len(late)), *shares, *(spread if came else [])]


if __name__ == "__main__":
    main()
