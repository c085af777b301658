"""The table of goals, the places where one may be, and who may be given one."""

import math
from dataclasses import replace
from typing import get_args

import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.errors import CommandRefusedError
from iveg.domain.geometry import Pose2D
from iveg.domain.goals import (
    ANSWERED_WITHIN_S,
    FollowedGoal,
    Goal,
    GoalEvent,
    GoalKind,
    GoalState,
    GoalWish,
    permit,
    place_of,
)
from iveg.domain.observations import Hold, Observation, Received
from iveg.domain.transports import DIRECT
from iveg.domain.world import World
from tests.builders import AGI, at, fleet_of, odometry, origin, safety_report

TESTBED = load_greenhouse("mvsim-20x20")
HERE = Pose2D(10.0, 4.0, 0.0)
GOAL = Goal("01G", "here", 2.0, 3.0)
OPEN = {"SENT", "DRIVING", "UNCONFIRMED", "CANCELLING"}
ENDS: dict[GoalEvent, GoalState] = {
    "reached": "REACHED",
    "dropped": "CANCELLED",
    "held": "DELETED",
    "replaced": "REPLACED",
}


def goal_in(state: GoalState) -> FollowedGoal:
    return replace(FollowedGoal("AGI", GOAL, "ana", at(0), at(0)), state=state)


# --- the table --------------------------------------------------------------------


@pytest.mark.parametrize("state", sorted(OPEN))
@pytest.mark.parametrize("event", ["held", "replaced", "dropped"])
def test_every_open_goal_ends_with_a_hold_a_successor_or_the_robots_word(
    state: GoalState, event: GoalEvent
) -> None:
    after = goal_in(state).after(event, at(3))

    assert (after.state, after.ended) == (ENDS[event], at(3))


@pytest.mark.parametrize("event", get_args(GoalEvent))
@pytest.mark.parametrize("state", sorted(set(get_args(GoalState)) - OPEN))
def test_what_has_ended_stays_ended(state: GoalState, event: GoalEvent) -> None:
    before = goal_in(state)

    assert before.after(event, at(3)) is before
    assert not before.is_open


def test_an_unanswered_goal_is_not_confirmed_and_a_late_word_still_counts() -> None:
    sent = goal_in("SENT")
    assert not sent.is_overdue(at(ANSWERED_WITHIN_S))
    assert sent.is_overdue(at(ANSWERED_WITHIN_S + 0.1))

    unconfirmed = sent.after("expired", at(10.1))

    assert (unconfirmed.state, unconfirmed.ended) == ("UNCONFIRMED", None)
    assert unconfirmed.after("accepted", at(12)).state == "DRIVING"


def test_a_cancellation_waits_for_its_own_answer() -> None:
    cancelling = goal_in("DRIVING").after("cancel", at(30))

    assert (cancelling.state, cancelling.ordered) == ("CANCELLING", at(30))
    assert not cancelling.is_overdue(at(35))
    assert cancelling.after("expired", at(41)).state == "UNCONFIRMED"


# --- places -----------------------------------------------------------------------


def place(
    kind: GoalKind, x: float = 0.0, y: float = 0.0, aisle: str | None = None
) -> tuple[float, float] | str:
    start = TESTBED.starts[0]
    return place_of(GoalWish(kind, x, y, aisle), TESTBED, AGI, HERE, start)


@pytest.mark.parametrize(
    ("x", "y", "why"),
    [
        (4.0, 10.0, "in_plants"), (4.0, 3.5, "in_plants"), (-3.0, 4.0, "outside"),
        (0.1, 4.0, "outside"), (1e6, 0.0, "outside"), (math.nan, 4.0, "outside"),
    ],
)  # fmt: skip
def test_a_place_outside_or_in_plants_is_none(x: float, y: float, why: str) -> None:
    assert place("here", x, y) == why


@pytest.mark.parametrize("label", [lane.label for lane in TESTBED.lanes])
def test_an_aisle_is_a_free_place_in_it(label: str) -> None:
    found = place("aisle", aisle=label)

    assert not isinstance(found, str)
    assert label in {one.label for one in TESTBED.lanes if one.area.contains(*found)}
    assert place("here", *found) == found


def test_return_and_pause_need_no_place() -> None:
    start = TESTBED.starts[0]

    assert place("return") == (start.x, start.y)
    assert place("pause") == (HERE.x, HERE.y)
    assert place_of(GoalWish("return"), TESTBED, AGI, HERE, None) == "no_start"


# --- who may ----------------------------------------------------------------------


def world_with(*heard: Observation) -> World:
    world = World(fleet_of("AGI"))
    for one in heard:
        world.apply(Received(one, at(0), DIRECT.id))
    return world


POSE = odometry(origin=replace(origin(1), mono=7.0))
FREE = safety_report(origin=replace(origin(1), mono=6.9))
HELD = safety_report("AGI", Hold("h", "hw", "local"))
HELD_BY_NOBODY = safety_report(reason="hold", speed_factor=0.0)


def test_a_free_robot_gets_the_challenge_and_ten_seconds_of_its_own_clock() -> None:
    robot = world_with(POSE, FREE).robot("AGI")

    order = permit(robot, "RUNNING", GOAL, at(0.2))

    assert (order.goal_id, order.challenge) == (GOAL.goal_id, FREE.challenge)
    assert (order.kind, order.x, order.y) == (GOAL.kind, GOAL.x, GOAL.y)
    assert order.until_s == 7.0 + ANSWERED_WITHIN_S


@pytest.mark.parametrize(
    ("why", "heard", "stop_state", "after_s"),
    [
        ("held", (POSE, FREE), "REQUESTED", 0.2),
        ("held", (POSE, FREE), "READY", 0.2),
        ("held", (POSE, HELD), "RUNNING", 0.2),
        ("held", (POSE, HELD_BY_NOBODY), "RUNNING", 0.2),
        ("no_pose", (FREE,), "RUNNING", 0.2),
        ("no_pose", (POSE, FREE), "RUNNING", 1.1),
        ("no_report", (POSE,), "RUNNING", 0.2),
        ("no_clock", (odometry(), safety_report()), "RUNNING", 0.2),
    ],
)
def test_a_robot_that_is_held_or_unknown_gets_no_goal(
    why: str, heard: tuple[Observation, ...], stop_state: str, after_s: float
) -> None:
    robot = world_with(*heard).robot("AGI")

    with pytest.raises(CommandRefusedError) as refused:
        permit(robot, stop_state, GOAL, at(after_s))

    assert refused.value.why == why
