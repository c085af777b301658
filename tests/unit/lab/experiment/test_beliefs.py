"""Who stands in a costmap without having been seen, and through whom."""

from typing import Any

import numpy as np
import pytest

from iveg.domain.costmap import InflatedGrid
from iveg.domain.feedback import Feedback, FeedbackAlert
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.observations import Origin
from iveg.domain.occupancy_grid import Grid
from iveg.domain.witness import Outline
from iveg.lab.experiment.beliefs import (
    Belief,
    belief_in,
    belief_of,
    injections,
    questions,
)
from iveg.lab.experiment.outcome import slowdowns_of
from iveg.lab.experiment.recording import picture_of
from iveg.lab.experiment.scoring import Picture, SeenObject
from iveg.robot.costmap import FleetCostmap
from iveg.robot.neighbours import Neighbours

FARMER = SeenObject("person-0", "farmer", 1.0, 1.0)


def look(robot_id: str, *seen: SeenObject, at: float = 0.0) -> Picture:
    return Picture(robot_id, at, seen)


def injected(
    truth: list[Picture], beliefs: list[tuple[float, Belief]]
) -> dict[str, int]:
    return injections(list(questions(truth, beliefs, "AGII")))


def answer(*, taken: bool) -> dict[str, Any]:
    cells = [0] * 400
    cells[10 * 20 + 10] = 100 if taken else 0
    grid = {"resolution": 0.1, "width": 20, "height": 20}
    return {**grid, "origin": {"x": 0.0, "y": 0.0}, "data": cells}


def costmap(*, taken: bool) -> InflatedGrid:
    data = np.zeros((20, 20), np.int8)
    data[10, 10] = 100 if taken else 0
    return InflatedGrid(Grid(0.1, 0.0, 0.0, 20, 20), data)


@pytest.mark.parametrize("taken", [True, False])
def test_somebody_out_of_sight_is_injected_when_the_costmap_has_them(
    *, taken: bool
) -> None:
    belief = belief_in(answer(taken=taken))

    found = injected([look("AGI", FARMER), look("AGII")], [(0.0, belief)])

    assert found == {
        "asked": 1,
        "injected": int(taken),
        "people": 1,
        "ahead": int(taken),
    }


def test_whom_a_robot_sees_itself_was_not_injected() -> None:
    both = [look("AGI", FARMER), look("AGII", FARMER)]

    found = injected(both, [(0.0, belief_in(answer(taken=True)))])

    assert found["asked"] == 0


def test_whom_a_robots_own_laser_found_was_not_injected() -> None:
    own = belief_of(costmap(taken=True), costmap(taken=True))
    told = belief_of(costmap(taken=False), costmap(taken=True))
    seen = [look("AGI", FARMER), look("AGII")]

    by_laser = injected(seen, [(0.0, own)])
    by_others = injected(seen, [(0.0, told)])

    assert (by_laser["asked"], by_laser["injected"]) == (0, 0)
    assert (by_others["asked"], by_others["injected"]) == (1, 1)


@pytest.mark.parametrize("told", [True, False])
def test_what_the_robot_itself_was_told_is_what_counts(*, told: bool) -> None:
    known = Neighbours("AGII")
    if told:
        person = FeedbackAlert("d", "", "person", "farmer", 0.9, (1, 1, 0.9), 2.0)
        known.note("AGI", Feedback("AGI", Origin("c", 1), None, (person,)), 0.0)
    here = Pose2D(8.0, 8.0, 0.0)
    kept = FleetCostmap("AGII", Outline(2.0, 1.2), Rectangle(0, 0, 10, 10))
    grid = kept.draw((), known.present(here, 0.1), here, 0.1)
    belief = belief_of(costmap(taken=False), grid)

    found = injected([look("AGI", FARMER), look("AGII")], [(0.0, belief)])

    assert (found["asked"], found["injected"]) == (1, int(told))


@pytest.mark.parametrize(("own_at", "ahead"), [(-1.0, 0), (1.0, 1)])
def test_only_who_was_told_of_before_the_own_camera_saw_them_is_ahead(
    own_at: float, ahead: int
) -> None:
    belief: Belief = belief_in(answer(taken=True))
    seen = [look("AGI", FARMER), look("AGII"), look("AGII", FARMER, at=own_at)]

    assert injected(seen, [(0.0, belief)])["ahead"] == ahead


def test_a_picture_is_read_as_live_tells_it() -> None:
    box = {"xmin": 2.0, "xmax": 3.0, "ymin": -1.0, "ymax": 0.0, "frame_id": "base_link"}
    item = {"class_id": "farmer", "position": {"x": 1.0, "y": 2.0}, "probability": 0.9}
    item |= {"box": box}
    told = {"robot_id": "AGI", "stamp": "2026-01-01T00:00:00.000Z", "items": [item]}

    picture = picture_of(told)

    assert picture is not None
    assert picture.seen == (SeenObject("0", "farmer", 1.0, 2.0, 0.9, (2.5, -0.5)),)
    assert picture_of({**told, "stamp": None}) is None


def test_slow_downs_are_counted_by_how_far_they_came() -> None:
    times = {"applied_at": "t", "observed_at": None}
    person = {**times, "reason": "person", "in_sight": False}
    stale = {**times, "reason": "stale", "in_sight": None}

    found = slowdowns_of([person, stale])

    assert found == {"decided": 1, "applied": 1, "observed": 0, "out_of_sight": 1}
