"""Why robots are slow with nobody within four metres: by the reason and its evidence.

    python -m benchmarks.needless --seeds 11,12 --seconds 300

The demo's greenhouse on the virtual clock, as in ``benchmarks.protection``, detector of
the field.  Seconds of robots that move; *over*: the reason has ended, and its second
runs; *no truth*: nobody really is where who was seen can have walked to since.  Of what
is remembered also why it has not ended: *unlooked*: no camera has the place in
view; *suspected*: a faint box, or for a box's ring any, is within a metre; *watched*:
for less than a second.

    python -m benchmarks.needless --seeds 11 --seconds 60 --each
    python -m benchmarks.needless --seeds 12 --after 600 --seconds 600 --plan-off 0.2

What is beside the plan is learnt in ten minutes: ``--after`` begins to count then.
"""

import argparse
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.process import print_table
from benchmarks.protection import staged
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.tracking.sight import visible_from
from iveg.lab.emulator.scripts import EXACT, SiteErrors
from iveg.lab.emulator.world import SimulatedWorld
from iveg.lab.experiment.protection import AWAY_M, MOVES_M_S
from iveg.lab.experiment.staged_robot import STEP_S
from iveg.pipeline.evaluate import Evaluator

_TRUE_M, _PAUSE_S = 1.0, 1.0


@dataclass(slots=True)
class Spell:
    """A robot was slow for one cause, without a pause of a second.

    Attributes:
        ring: Age (s) and radius (m) of the ring as it began; None: it was none.
    """

    at: float
    robot: str
    cause: str
    ring: tuple[float, float] | None
    until: float


def causes(
    seed: int,
    seconds: float,
    errors: SiteErrors = EXACT,
    spells: list[Spell] | None = None,
    after: float = 0.0,
) -> Counter[str]:
    """Seconds of needless slowness by cause; ``driving``: of all that they moved.

    Each spell of it is appended to ``spells``; the first seconds (``after``) count not.
    """
    stage, world, iveg = staged("field", seed, DetectionRule(), errors=errors)
    found, open_ = Counter[str](), dict[tuple[str, str], Spell]()
    for number in range(round((after + seconds) / STEP_S)):
        stage.step()
        if number < after / STEP_S:
            continue
        for robot_id, rig in world.rigs.items():
            if abs(rig.vehicle.twist.linear_x) <= MOVES_M_S:
                continue
            found["driving"] += 1
            here = rig.vehicle.pose
            away = min(here.distance_to(one.x, one.y) for one in world.discs())
            slow = stage.robots[robot_id].driving.factor <= HALF_SPEED
            if slow and away > max(AWAY_M):
                evaluator, now = iveg.parts.evaluator, stage.now
                cause, ring = _cause(evaluator, robot_id, world, now)
                found[cause] += 1
                spell = open_.get((robot_id, cause))
                if spell is None or now.mono - spell.until > _PAUSE_S:
                    spell = Spell(now.mono, robot_id, cause, ring, now.mono)
                    open_[robot_id, cause] = spell
                    if spells is not None:
                        spells.append(spell)
                spell.until = now.mono
    return found


def _cause(
    evaluator: Evaluator, robot_id: str, world: SimulatedWorld, now: Instant
) -> tuple[str, tuple[float, float] | None]:
    limit = evaluator.speed_limits[robot_id]
    if limit.speed_factor > HALF_SPEED:
        report = evaluator.world.robot(robot_id).safety
        reason = "unknown" if report is None else report.reason
        return f"robot's own: {reason}", None
    if limit.over:
        return f"{limit.reason}, over", None
    mine = [one for one in evaluator.crossings if one.robot_id == robot_id]
    zone = next(
        (one.zone for one in mine if one.decision_id == limit.decision_id), None
    )
    if zone is None or zone.sighting is None:
        return limit.reason, None
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
    rings = () if person is None else person.rings(evaluator.rule, now)
    oldest = max(rings, key=lambda one: one[1], default=None)
    if oldest is None:
        return ", ".join(words), None
    ring, radius_m = oldest
    if person is not None and ring.age_s(now) > LIMITS.seen_s:
        words.append(_why_not_ended(evaluator, person, ring, now))
    return ", ".join(words), (ring.age_s(now), radius_m)


def _why_not_ended(
    evaluator: Evaluator, person: TrackedPerson, ring: Sighting, now: Instant
) -> str:
    """What the all-clear of a ring lacks."""
    looks = set(_looks(evaluator, person, ring, now))
    return next((one for one in ("watched", "suspected") if one in looks), "unlooked")


def _looks(
    evaluator: Evaluator, person: TrackedPerson, ring: Sighting, now: Instant
) -> Iterator[str]:
    spots = np.array([(ring.x, ring.y)])
    for robot in evaluator.world.live_robots():
        if visible_from(robot, spots, evaluator.greenhouse, now).size:
            is_faint = evaluator.people.is_suspected(person, ring, robot.robot_id)
            yield "suspected" if is_faint else "watched"


def main() -> None:
    """Print the causes of all seeds together, the greatest first."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seeds", default="11,12,13,14")
    options.add_argument("--seconds", type=float, default=300.0)
    options.add_argument("--after", type=float, default=0.0)
    options.add_argument("--each", action="store_true")
    options.add_argument("--plan-off", type=float, default=0.0)
    options.add_argument("--pose-error", type=float, default=1.0)
    asked = options.parse_args()
    errors = SiteErrors(asked.plan_off, asked.pose_error)
    found, spells = Counter[str](), list[Spell]()
    for seed in asked.seeds.split(","):
        found += causes(int(seed), asked.seconds, errors, spells, asked.after)
    driving = found.pop("driving", 0)
    rows = [
        [cause, f"{steps * STEP_S:.1f}", f"{100 * steps / max(1, driving):.1f} %"]
        for cause, steps in found.most_common()
    ]
    head = ("cause", "seconds", "of driving")
    print_table(f"Needless slowness, seeds {asked.seeds}", head, rows)
    if asked.each:
        each = ("at", "robot", "for", "age of the ring", "radius", "cause")
        print_table("Each", each, [_told(one) for one in spells])


def _told(spell: Spell) -> list[str]:
    age, radius = ("–", "–") if spell.ring is None else (f"{n:.1f}" for n in spell.ring)
    lasted = f"{spell.until - spell.at + STEP_S:.2f} s"
    return [f"{spell.at:.2f}", spell.robot, lasted, age, radius, spell.cause]


if __name__ == "__main__":
    main()
