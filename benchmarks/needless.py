"""Why robots are slow with nobody within four metres: by the reason and its evidence.

    python -m benchmarks.needless --seeds 11,12 --seconds 300

The demo's greenhouse on the virtual clock, as in ``benchmarks.protection``, detector of
the field.  Seconds of robots that move; *over*: the reason has ended, and its second
runs; *no truth*: nobody really is where who was seen can have walked to since.
"""

import argparse
import math
from collections import Counter

from benchmarks.process import print_table
from benchmarks.protection import staged
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.lab.emulator.scripts import EXACT, SiteErrors
from iveg.lab.emulator.world import SimulatedWorld
from iveg.lab.experiment.protection import AWAY_M, MOVES_M_S
from iveg.lab.experiment.stage import STEP_S
from iveg.pipeline.evaluate import Evaluator

_TRUE_M = 1.0


def causes(seed: int, seconds: float, errors: SiteErrors = EXACT) -> Counter[str]:
    """Seconds of needless slowness by cause; ``driving``: of all that they moved."""
    stage, world, iveg = staged("field", seed, DetectionRule(), errors=errors)
    found = Counter[str]()
    for _ in range(round(seconds / STEP_S)):
        stage.step()
        for robot_id, rig in world.rigs.items():
            if abs(rig.vehicle.twist.linear_x) <= MOVES_M_S:
                continue
            found["driving"] += 1
            here = rig.vehicle.pose
            away = min(here.distance_to(one.x, one.y) for one in world.discs())
            slow = stage.robots[robot_id].driving.factor <= HALF_SPEED
            if slow and away > max(AWAY_M):
                evaluator = iveg.parts.evaluator
                found[_cause(evaluator, robot_id, world, stage.now)] += 1
    return found


def _cause(
    evaluator: Evaluator, robot_id: str, world: SimulatedWorld, now: Instant
) -> str:
    limit = evaluator.speed_limits[robot_id]
    if limit.speed_factor > HALF_SPEED:
        report = evaluator.world.robot(robot_id).safety
        return f"robot's own: {'unknown' if report is None else report.reason}"
    if limit.over:
        return f"{limit.reason}, over"
    mine = [one for one in evaluator.crossings if one.robot_id == robot_id]
    zone = next(
        (one.zone for one in mine if one.decision_id == limit.decision_id), None
    )
    if zone is None or zone.sighting is None:
        return limit.reason
    # The crossing keeps the circle of its beginning; where they are now counts.
    person = evaluator.people.known.get(zone.cause)
    newest = zone.sighting if person is None else person.newest
    age = newest.age_s(now)
    words = [limit.reason, "laser" if newest.laser else "camera"]
    words.append("in sight" if age <= LIMITS.seen_s else "remembered")
    if limit.foretold_s is not None:
        words.append("ahead")
    reach = _TRUE_M + LIMITS.walking_m_s * age
    there = (math.dist((one.x, one.y), (newest.x, newest.y)) for one in world.discs())
    if min(there) > reach:
        words.append("no truth")
    return ", ".join(words)


def main() -> None:
    """Print the causes of all seeds together, the greatest first."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seeds", default="11,12,13,14")
    options.add_argument("--seconds", type=float, default=300.0)
    options.add_argument("--plan-off", type=float, default=0.0)
    options.add_argument("--pose-error", type=float, default=1.0)
    asked = options.parse_args()
    errors = SiteErrors(asked.plan_off, asked.pose_error)
    found = Counter[str]()
    for seed in asked.seeds.split(","):
        found += causes(int(seed), asked.seconds, errors)
    driving = found.pop("driving", 0)
    rows = [
        [cause, f"{steps * STEP_S:.1f}", f"{100 * steps / max(1, driving):.1f} %"]
        for cause, steps in found.most_common()
    ]
    head = ("cause", "seconds", "of driving")
    print_table(f"Needless slowness, seeds {asked.seeds}", head, rows)


if __name__ == "__main__":
    main()
