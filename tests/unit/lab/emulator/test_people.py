import math

import numpy as np

from iveg.domain.geometry import PERSON_RADIUS_M, Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.lab.emulator.greenhouse import Body, Scenery
from iveg.lab.emulator.people import WALKING_SPEED, SimulatedPerson, WalkStop

DT = 0.05
OPEN = Scenery.of(Greenhouse("yard", Rectangle(-10.0, -10.0, 20.0, 10.0)))


def person(*stops: WalkStop, seed: int = 1) -> SimulatedPerson:
    return SimulatedPerson(stops, np.random.default_rng(seed))


def test_a_person_walks_at_walking_pace_and_arrives() -> None:
    walker = person(WalkStop(0.0, 0.0), WalkStop(7.0, 0.0, 60.0, 60.0))

    walker.step(DT, [], OPEN)
    walker.step(DT, [], OPEN)
    first = walker.x
    for _ in range(round(7.0 / WALKING_SPEED / DT) + 2):
        walker.step(DT, [], OPEN)

    assert first <= 2 * WALKING_SPEED * DT + 1e-9
    assert math.hypot(walker.x - 7.0, walker.y) < 0.1


def test_a_person_stays_at_a_stop_and_then_goes_on() -> None:
    worker = person(WalkStop(0.0, 0.0, 2.0, 2.0), WalkStop(5.0, 0.0, 60.0, 60.0))

    places = []
    for _ in range(80):
        worker.step(DT, [], OPEN)
        places.append(worker.x)

    assert places[30] == 0.0
    assert places[-1] > 1.0


def test_the_same_seed_walks_the_same_way() -> None:
    round_ = (WalkStop(0.0, 0.0, 0.0, 3.0), WalkStop(5.0, 0.0, 0.0, 3.0))
    one, other = person(*round_, seed=7), person(*round_, seed=7)

    for _ in range(300):
        one.step(DT, [], OPEN)
        other.step(DT, [], OPEN)

    assert (one.x, one.y) == (other.x, other.y)


def test_a_person_walks_round_a_robot_that_stands_in_the_way() -> None:
    walker = person(WalkStop(0.0, 0.0), WalkStop(8.0, 0.0, 60.0, 60.0))
    robot = Body("AGI", Pose2D(4.0, 0.0, 0.0), 1.0, 0.6)

    gaps = []
    for _ in range(400):
        walker.step(DT, [robot], OPEN)
        gaps.append(robot.gap_to(walker.x, walker.y)[0])

    assert min(gaps) > PERSON_RADIUS_M
    assert math.hypot(walker.x - 8.0, walker.y) < 0.1


def test_a_person_steps_aside_for_a_robot_that_comes_near() -> None:
    worker = person(WalkStop(0.0, 0.0, 600.0, 600.0))
    robot = Body("AGI", Pose2D(0.0, 0.6, 0.0), 1.0, 0.6)

    for _ in range(40):
        worker.step(DT, [robot], OPEN)

    assert robot.gap_to(worker.x, worker.y)[0] > PERSON_RADIUS_M + 0.4


def test_a_person_never_walks_into_crop() -> None:
    row = Rectangle(2.0, -5.0, 3.0, 5.0)
    yard = Scenery.of(Greenhouse("yard", Rectangle(-9.0, -9.0, 9.0, 9.0), rows=(row,)))
    walker = person(WalkStop(0.0, 0.0), WalkStop(6.0, 1.0, 9.0, 9.0))

    for _ in range(200):
        walker.step(DT, [], yard)
        assert not row.contains(walker.x, walker.y, PERSON_RADIUS_M - 1e-9)


def test_a_person_who_was_placed_stays_when_held() -> None:
    walker = person(WalkStop(0.0, 0.0), WalkStop(7.0, 0.0))

    walker.place(3.0, 3.0, hold=True)
    walker.step(DT, [], OPEN)

    assert (walker.x, walker.y) == (3.0, 3.0)
