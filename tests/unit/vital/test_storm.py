"""Many messages at once, and a detector that says more than can be judged."""

import pytest

from iveg.domain.observations import Observation, Received
from iveg.vital.feedback import MOST_ALERTS
from tests.builders import START, detection, detection_frame, odometry
from tests.unit.vital.desk import Desk, conditions_of
from tests.unit.vital.test_frames import factors

ALERT = "alert.pictures_not_judged"


def driving(desk: Desk) -> Desk:
    for robot_id, x in (("AGI", 0.0), ("AGII", 10.0)):
        desk.drive(robot_id, x)
        desk.look(robot_id)
    return desk


def test_what_arrives_together_is_judged_and_told_once() -> None:
    desk = driving(Desk())
    desk.clock.now = 0.01
    before = len(desk.fleet.told)
    somebody = detection(x=0.5, y=0.0)
    looks: list[Observation] = [
        odometry("AGI", 0.1, origin=desk.next_origin()),
        odometry("AGII", 1.0, origin=desk.next_origin()),
        detection_frame("AGI", somebody, origin=desk.next_origin()),
        detection_frame("AGII", somebody, origin=desk.next_origin()),
    ]

    desk.loop.step([Received(one, desk.clock()) for one in looks], desk.clock())

    assert len(desk.fleet.told) - before == len(desk.world.robots)
    assert factors(desk) == [0.5, 0.5]


def test_who_must_slow_down_is_told_at_once_and_the_rest_ten_times_a_second() -> None:
    desk = driving(Desk())
    told = []
    for tick in range(200):
        desk.clock.now = 0.1 + tick * 0.005
        before = len(desk.fleet.told)
        desk.look("AGI", detection(x=0.5 + 0.004 * tick, y=100.0 * (tick % 2)))
        told.append(len(desk.fleet.told) > before)
    slowed_at = next(one.entered.mono for one in desk.evaluator.entries)
    assert slowed_at == pytest.approx(START.mono + 0.1)
    assert told[0]
    assert sum(told) <= 13


async def test_a_storm_slows_who_is_near_and_is_an_alert_until_it_is_over() -> None:
    desk = driving(Desk())
    for _ in range(100):
        desk.clock.now += 0.001
        desk.look("AGI")

    await desk.wait(0.05)

    assert factors(desk) == [0.5, 0.5]
    assert desk.evaluator.speed_limits["AGII"].cause == "AGI"
    assert list(conditions_of(desk)).count(ALERT) == 1
    # It is over a second after the last picture that was not judged.
    await desk.wait(1.0)
    driving(desk)
    await desk.wait(0.05)
    assert factors(desk) == [1.0, 1.0]
    assert ALERT in conditions_of(desk)
    await desk.wait(9.5)
    assert ALERT not in conditions_of(desk)


async def test_nobody_who_is_known_is_dropped_and_robots_can_read_what_they_hear() -> (
    None
):
    desk = driving(Desk())
    desk.look("AGI", detection(x=0.5, y=0.0))
    for turn in range(40):
        desk.clock.now += 0.05
        crowd = (detection(x=3.0 * n, y=10.0 + 7.0 * turn) for n in range(20))
        desk.look("AGII", *crowd)
    await desk.wait(0.1)
    known = desk.evaluator.people.known
    assert next(iter(known)) == "P1"
    assert len(desk.fleet.told[-1].alerts) <= MOST_ALERTS
    assert ALERT in conditions_of(desk)
