"""A goal on the robot: taken once and in time; gone with every hold."""

from dataclasses import replace

import orjson
import pytest

from iveg.domain.geometry import Pose2D
from iveg.domain.goals import CancelOrder, Goal, GoalOrder
from iveg.domain.observations import GoalAnswer
from iveg.ngsi import codec
from iveg.ngsi.codec import read_goal
from iveg.robot.goals import Facts, RobotGoals

ORDER = GoalOrder("01G", "here", 2.0, 3.0, "c1", 17.0)
FREE = Facts(
    runs=True, challenge="c1", own_s=8.0, pose=Pose2D(0.0, 0.0, 0.0), stands=False
)
THERE = replace(FREE, pose=Pose2D(2.1, 3.1, 0.0), stands=True)


class Robot:
    """Goals over a navigation that notes what it is told."""

    def __init__(self, *, knows_a_way: bool = True) -> None:
        self.told: list[Goal | None] = []
        self._knows = knows_a_way
        self.goals = RobotGoals("AGI", self.navigate)

    def navigate(self, goal: Goal | None) -> bool:
        self.told.append(goal)
        return self._knows

    def take(self, order: GoalOrder | CancelOrder, facts: Facts = FREE) -> list[str]:
        return said(self.goals.answer(order, facts))

    def settle(self, facts: Facts) -> list[str]:
        return said(self.goals.settle(facts))


def said(answers: list[GoalAnswer]) -> list[str]:
    return [f"{one.id} {one.result} {one.why or ''}".strip() for one in answers]


def test_a_free_robot_takes_a_goal_and_says_when_it_is_there() -> None:
    robot = Robot()

    assert robot.take(ORDER) == ["01G ACCEPTED"]
    assert robot.told == [ORDER]
    assert robot.settle(FREE) == []
    assert robot.settle(replace(THERE, stands=False)) == []
    assert robot.settle(THERE) == ["01G REACHED"]
    assert robot.settle(THERE) == []


@pytest.mark.parametrize(
    ("why", "facts"),
    [
        ("held", replace(FREE, runs=False)),
        ("challenge", replace(FREE, challenge="c2")),
        ("too_late", replace(FREE, own_s=17.1)),
        ("no_pose", replace(FREE, pose=None)),
    ],
)
def test_a_goal_is_refused_and_navigation_hears_nothing(why: str, facts: Facts) -> None:
    robot = Robot()

    assert robot.take(ORDER, facts) == [f"01G REFUSED {why}"]
    assert robot.told == []
    assert robot.goals.goal is None


def test_a_cancellation_that_overtakes_its_goal_wins() -> None:
    robot = Robot()

    assert robot.take(CancelOrder("01G")) == ["01G DROPPED cancelled"]
    assert robot.take(ORDER) == ["01G REFUSED cancelled"]
    assert robot.told == []


def test_a_new_goal_takes_the_place_of_the_old_one() -> None:
    robot = Robot()
    robot.take(ORDER)
    other = replace(ORDER, goal_id="01H")

    assert robot.take(other) == ["01G DROPPED replaced", "01H ACCEPTED"]
    assert robot.goals.goal == other


# --- the wire ---------------------------------------------------------------------


SET = codec.write_order(ORDER)[1]["set"]
assert isinstance(SET, dict)


@pytest.mark.parametrize(
    "message",
    [
        {"cmd": {"stop": {"id": "01A"}}},
        {"goal": {"set": SET}, "cmd": "STOP"},
        {"goal": {"set": {**SET, "kind": "stop"}}},
        {"goal": {"set": {**SET, "id": "STOP"}}},
        {"goal": {"set": SET, "cancel": {"id": "01G"}}},
        {"goal": {"set": {**SET, "speed": 3.0}}},
        {"goal": None},
    ],
)
def test_anything_else_is_left_to_the_reader_of_stop(message: object) -> None:
    assert read_goal(orjson.dumps(message)) is None
