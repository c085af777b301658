"""Scans that come anyway earn the all-clear of a place that no camera looks at."""

import math
from functools import partial

import numpy as np
import pytest

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import LaserScan, UnreadScan
from iveg.lab.emulator.greenhouse import Disc, Scenery
from iveg.lab.emulator.lidar import LaserModel, sweep
from tests.builders import detection, scan
from tests.unit.pipeline.desk import Desk

HALL = Greenhouse("hall", Rectangle(-8.0, -8.0, 8.0, 8.0))
MODEL = LaserModel()
BEHIND = (-4.0, 0.0)


def swept(desk: Desk, *people: tuple[float, float]) -> LaserScan:
    """What AGI's laser sees from the middle of the hall."""
    ranges = sweep(
        Pose2D(0.0, 0.0, 0.0),
        MODEL,
        Scenery.of(HALL),
        [Disc(x, y, 0.25) for x, y in people],
        [],
        np.random.default_rng(desk.seq),
    )
    return scan(
        "AGI",
        ranges.tolist(),
        angle_min=-math.pi,
        angle_increment=MODEL.angle_increment,
        range_max=MODEL.range_max,
        origin=desk.next_origin(),
    )


def rings_after(seconds: float, *people: tuple[float, float], laser: bool) -> int:
    """AGI stands and looks east; two seconds ago somebody was seen in the west."""
    desk = Desk(("AGI",), HALL)
    desk.drive("AGI", linear=0.0)
    desk.look("AGI", detection("person", *BEHIND))
    for _ in range(round((2.0 + seconds) / 0.1)):
        desk.clock.now = round(desk.clock.now + 0.1, 6)
        desk.drive("AGI", linear=0.0)
        desk.look("AGI")
        if laser and desk.clock.now > 2.0:
            said = swept(desk, *people)
            desk.hear(UnreadScan(said.robot_id, said.origin, partial(_same, said)))
        desk.loop.step([], desk.clock())
    return sum(len(one.sightings) for one in desk.evaluator.people.known.values())


def _same(scan: LaserScan) -> LaserScan:
    return scan


@pytest.mark.parametrize(
    ("seconds", "people", "laser", "rings"),
    [
        (1.5, (), True, 0),
        (0.8, (), True, 1),
        (1.5, (), False, 1),
        (1.5, (BEHIND,), True, 1),
        (1.5, ((-2.0, 3.0),), True, 1),
    ],
)
def test_a_ring_behind_a_robot_goes_once_its_laser_has_swept_the_place(
    seconds: float, people: tuple[tuple[float, float], ...], laser: bool, rings: int
) -> None:
    assert rings_after(seconds, *people, laser=laser) == rings


def test_a_scan_that_cannot_be_read_keeps_the_ring_and_ends_nothing() -> None:
    desk = Desk(("AGI",), HALL)
    desk.look("AGI", detection("person", *BEHIND))
    desk.clock.now = 2.0
    desk.drive("AGI", linear=0.0)
    broken = swept(desk)

    def fail() -> LaserScan:
        raise ValueError("not a scan")

    desk.hear(UnreadScan("AGI", broken.origin, fail))
    desk.clock.now = 2.2
    desk.loop.step([], desk.clock())

    (person,) = desk.evaluator.people.known.values()
    assert len(person.sightings) == 1
    assert desk.ingest.counters["rejected.unreadable_scan"] == 1
