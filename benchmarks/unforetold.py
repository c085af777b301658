"""Why entries were not foretold 1.5 s before: by cause, and each one (``--each``).

    python -m benchmarks.unforetold --seeds 11,12 --seconds 300

The demo's greenhouse on the virtual clock, as in ``benchmarks.protection``, detector of
the field; entries around somebody who has been in view for two seconds.  The cause is
that of most looks in the 1.5 s before iVeg began to tell of the encounter:

*unknown*, *remembered*: nobody, or nobody seen within the last two seconds, within a
metre of the person; *elsewhere*: somebody farther away; *inside*: the robot was in a
ring of theirs already; *forecast*: the person's true place and velocity would have
foretold it; *person*: they stood or went elsewhere then; *robot*: it did; *both*.
"""

import argparse
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.foresight import Place, Places, places_in
from benchmarks.process import print_table
from benchmarks.protection import staged
from iveg.app.virtual import VirtualPipeline
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.observations import Instant
from iveg.domain.rule.foresight import path_of
from iveg.domain.rule.paths import AHEAD_S as PATH_S
from iveg.domain.rule.paths import MOVES_M_S, Path
from iveg.domain.rule.zones import Zone, zones_of
from iveg.lab.emulator.truth import true_picture
from iveg.lab.experiment.moments import moments_of
from iveg.lab.experiment.protection import AHEAD_S, NEAR_M
from iveg.lab.experiment.protection_scoring import entries_of
from iveg.lab.experiment.recording import Row
from iveg.lab.experiment.staged_robot import STEP_S
from iveg.lab.experiment.virtual_run import foretold_row

_SAME_M = 1.0
_NEAR_M = 3.0
_YOUNG_S = 2.0


@dataclass(frozen=True, slots=True)
class Look:
    """What iVeg had at one step.

    Attributes:
        paths: Of each robot that drives.
        told: By robot where those are whom it will meet.
        rings: Of people, with the age of what was seen (s).
    """

    paths: Mapping[str, Path]
    told: Mapping[str, list[Place]]
    rings: list[tuple[Zone, float]]


@dataclass(frozen=True, slots=True)
class Missed:
    """An entry that was not foretold in time."""

    seed: int
    robot: str
    person: str
    at: float
    foretold_s: float | None
    cause: str


def look_now(iveg: VirtualPipeline, told: Mapping[str, Row], now: Instant) -> Look:
    """What iVeg has at this step."""
    world, evaluator = iveg.parts.world, iveg.parts.evaluator
    drive = (
        one
        for one in world.live_robots()
        if one.odometry and abs(one.odometry.twist.linear_x) >= MOVES_M_S
    )
    rings = [
        (zone, zone.sighting.age_s(now))
        for zone in zones_of(world, evaluator.people, evaluator.rule, now)
        if zone.sighting is not None and zone.reason == "person"
    ]
    places = {
        name: [(one["x"], one["y"]) for one in row["people"]]
        for name, row in told.items()
    }
    return Look({one.robot_id: path_of(one, now) for one in drive}, places, rings)


def missed(seed: int, seconds: float) -> Iterator[Missed | None]:
    """Each entry of a run; None: it was foretold."""
    stage, world, iveg = staged("field", seed, DetectionRule())
    truth, told = list[Row](), list[Row]()
    places, looks = list[Places](), list[Look]()
    for _ in range(round(seconds / STEP_S)):
        stage.step()
        now: dict[str, Row] = {}
        for robot_id, rig in world.rigs.items():
            driving = stage.robots[robot_id].driving
            truth.append(true_picture(rig, world, stage.now.mono, driving))
            told.append(foretold_row(iveg, truth[-1]))
            now[robot_id] = told[-1]
        places.append(places_in(world))
        looks.append(look_now(iveg, now, stage.now))
    first_at = truth[0]["at"]
    for moment, person, entry in entries_of(moments_of(truth, told)):
        if entry.known != "in_view":
            continue
        if entry.is_foretold:
            yield None
            continue
        step = round((moment.at - first_at) / STEP_S)
        of = moment.robot_id, person.name
        found = _cause(step, entry.foretold_s, places, looks, of)
        yield Missed(seed, *of, moment.at, entry.foretold_s, found)


def _cause(
    step: int,
    foretold_s: float | None,
    places: list[Places],
    looks: list[Look],
    of: tuple[str, str],
) -> str:
    """What most looks in which it was not told lacked."""
    until = step - round((foretold_s or 0.0) / STEP_S)
    why = Counter(
        _lacked(one, places, looks[one], of)
        for one in range(max(2, until - round(AHEAD_S / STEP_S)), until)
        if not _is_told(places[one], looks[one], of)
    )
    return max(why, key=lambda cause: why[cause])


def _is_told(places: Places, look: Look, of: tuple[str, str]) -> bool:
    robot, person = of
    told = look.told.get(robot, ())
    return any(math.dist(one, places[person]) <= _SAME_M for one in told)


def _lacked(step: int, places: list[Places], look: Look, of: tuple[str, str]) -> str:
    """Why a look did not foretell it."""
    robot, person = of
    here, there = places[step][robot], places[step][person]
    path = look.paths.get(robot)
    if path is None:
        return "robot"
    away = [(math.dist((z.x, z.y), there), z, age) for z, age in look.rings]
    if not any(far <= _SAME_M and age <= _YOUNG_S for far, _, age in away):
        if any(far <= _SAME_M for far, _, _ in away):
            return "remembered"
        return "elsewhere" if any(far <= _NEAR_M for far, *_ in away) else "unknown"
    if any(
        far <= _SAME_M and age <= _YOUNG_S and math.dist((z.x, z.y), here) <= z.radius_m
        for far, z, age in away
    ):
        return "inside"
    before = places[step - 2][person]
    goes = [
        (now - then) / (2 * STEP_S) for now, then in zip(there, before, strict=True)
    ]
    on = there[0] + goes[0] * PATH_S, there[1] + goes[1] * PATH_S
    really = [_really(places, step, one) for one in of]
    if _meet(path, on):
        return "forecast"
    alone = _meet(path, really[1]), _meet(really[0], on)
    return {(True, False): "person", (False, True): "robot"}.get(alone, "both")


def _really(places: list[Places], step: int, name: str) -> Path:
    """Where somebody was in the next three seconds."""
    every = round((PATH_S[1] - PATH_S[0]) / STEP_S)
    steps = [min(step + one * every, len(places) - 1) for one in range(len(PATH_S))]
    x, y = np.array([places[one][name] for one in steps]).T
    return x, y


def _meet(one: Path, other: Path) -> bool:
    apart = np.hypot(one[0] - other[0], one[1] - other[1])
    return bool((apart <= NEAR_M).any())


def main() -> None:
    """Print the causes of all seeds together, the most frequent first."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seeds", default="11,12,13,14")
    options.add_argument("--seconds", type=float, default=300.0)
    options.add_argument("--each", action="store_true")
    asked = options.parse_args()
    seeds = [int(one) for one in asked.seeds.split(",")]
    entries = [one for seed in seeds for one in missed(seed, asked.seconds)]
    late = [one for one in entries if one is not None]
    causes = Counter(one.cause for one in late)
    title = f"{len(late)} of {len(entries)} not foretold {AHEAD_S:g} s before"
    rows = [[cause, str(count)] for cause, count in causes.most_common()]
    print_table(f"{title}, seeds {asked.seeds}", ("cause", "entries"), rows)
    if asked.each:
        each = [
            [
                *(str(one.seed), f"{one.at:.2f}", one.robot, one.person),
                "–" if one.foretold_s is None else f"{one.foretold_s:.2f}",
                one.cause,
            ]
            for one in late
        ]
        head = ("seed", "at (s)", "robot", "person", "told before (s)", "cause")
        print_table("Each", head, each)


if __name__ == "__main__":
    main()
