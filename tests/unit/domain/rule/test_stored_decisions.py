"""A simulated minute, judged every 20 ms, comes to the stored decisions.

python -m tests.unit.domain.rule.test_stored_decisions    # stores them anew
"""

import json
import math
import random
from pathlib import Path

import pytest

from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from tests.unit.domain.scene import Scene, person

STORED = Path(__file__).parents[3] / "data" / "decisions.json"
GRID_S, SECONDS = 0.02, 60
WITHIN_S = 0.1
ROWS = Greenhouse("rows", Rectangle(-5, -5, 40, 10), rows=(Rectangle(4, 1.6, 26, 2.4),))
SPEEDS = {"AGI": 1.0, "AGII": 0.6}
"""Of robots that nothing slows (m/s)."""
Told = list[tuple[float, str, str, str | None]]
"""Moment (s), robot, what of it changed, cause."""


def people_at(now: float) -> dict[str, list[tuple[float, float]]]:
    """Places of the people whom each robot may see: one walks, one comes and stands."""
    walker = 20.0 - 0.5 * now, 0.5
    stands = 12.0, max(0.4, 6.0 - 0.4 * now)
    return {"AGI": [walker], "AGII": [walker, stands] if now < 35.0 else []}


def played() -> Told:
    """Both robots drive up and down an aisle each, as fast as they are told."""
    draw = random.Random(7)  # noqa: S311 - the same each time
    scene = Scene(greenhouse=ROWS)
    places, speeds = {"AGI": (0.0, 0.0), "AGII": (24.0, 4.0)}, dict(SPEEDS)
    heading, factors, told = {"AGI": 1, "AGII": -1}, dict[str, float](), Told()
    for step in range(round(SECONDS / GRID_S)):
        scene.now = round(step * GRID_S, 6)
        for robot_id, (x, y) in places.items():
            yaw = 0.0 if heading[robot_id] > 0 else math.pi
            scene.drive(robot_id, x, y, yaw, linear=speeds[robot_id])
            if step % 5 == 0:
                noise = draw.gauss(0.0, 0.05), draw.gauss(0.0, 0.05)
                seen = [
                    person(px + noise[0], py + noise[1], probability=0.9)
                    for px, py in people_at(scene.now)[robot_id]
                    if 0.0 < (px - x) * heading[robot_id] < 10.0 and draw.random() < 0.8
                ]
                scene.look(robot_id, *seen)
        begun = len(scene.changes)
        for robot_id, limit in scene.judge().items():
            if factors.get(robot_id) != limit.speed_factor:
                factors[robot_id] = limit.speed_factor
                change = f"{limit.reason} {limit.speed_factor}"
                told.append((scene.now, robot_id, change, limit.cause))
            gap = limit.speed_factor * SPEEDS[robot_id] - speeds[robot_id]
            speeds[robot_id] += min(0.01, max(-0.02, gap))
            x, y = places[robot_id]
            places[robot_id] = x + heading[robot_id] * speeds[robot_id] * GRID_S, y
            if not -1.0 <= x <= 25.0:
                heading[robot_id] = 1 if x < 0.0 else -1
        told += [
            (
                scene.now,
                one.entry.robot_id,
                "enters" if one.began else "leaves",
                one.entry.zone.cause,
            )
            for one in scene.changes[begun:]
        ]
    return told


def by_fact(told: Told) -> dict[tuple[str, str, str | None], list[float]]:
    """The moments of each change of each robot for each cause."""
    moments: dict[tuple[str, str, str | None], list[float]] = {}
    for at_s, robot_id, change, cause in told:
        moments.setdefault((robot_id, change, cause), []).append(at_s)
    return moments


def test_a_minute_comes_to_the_stored_decisions_within_a_tenth() -> None:
    now, stored = by_fact(played()), by_fact(json.loads(STORED.read_text()))
    assert now.keys() == stored.keys()
    for fact, moments in stored.items():
        assert now[fact] == pytest.approx(moments, abs=WITHIN_S), fact


if __name__ == "__main__":
    rows = ",\n".join(f"  {json.dumps(one)}" for one in played())
    STORED.write_text(f"[\n{rows}\n]\n")
