"""Goals between a person, the transports and the robot's own word."""

from dataclasses import replace

import pytest

from iveg.domain.goals import CancelOrder, FollowedGoal, GoalOrder, GoalWish
from iveg.domain.observations import GoalAnswer, Hold, Origin
from iveg.domain.records import CommandEventRecord, CommandRecord
from iveg.domain.stop.commands import outcome_of
from tests.builders import odometry, safety_report
from tests.unit.vital.desk import Desk, settle

THERE = GoalWish("here", 5.0, 6.0)


def counted(desk: Desk) -> Origin:
    return replace(desk.next_origin(), mono=desk.clock.now)


def free(desk: Desk, *holds: Hold) -> None:
    """AGI says where it is and that it may drive, or what holds it."""
    limit = (0.0, "hold") if holds else (1.0, "clear")
    desk.hear(odometry("AGI", 3.0, linear=0.0, origin=counted(desk)))
    desk.hear(
        safety_report(
            "AGI", *holds, speed_factor=limit[0], reason=limit[1], origin=counted(desk)
        )
    )


async def sent(wish: GoalWish = THERE) -> Desk:
    desk = Desk()
    free(desk)
    desk.parts.goals.give("AGI", wish, "ana", desk.clock())
    await settle()
    return desk


def newest(desk: Desk) -> FollowedGoal:
    goal = desk.parts.goals.newest("AGI", desk.clock())
    assert goal is not None
    return goal


def say(desk: Desk, result: str, why: str | None = None) -> None:
    goal_id = newest(desk).goal.goal_id
    origin = replace(counted(desk), stamp=None, stamp_s=None)
    desk.hear(GoalAnswer("AGI", origin, goal_id, result, why))


async def test_a_goal_goes_once_on_each_transport_with_challenge_and_deadline() -> None:
    desk = await sent()
    await desk.wait(3.0)

    (orders,) = [desk.fleet.goals]
    ((robot_id, order),) = orders
    assert isinstance(order, GoalOrder)
    assert (robot_id, order.x, order.y) == ("AGI", 5.0, 6.0)
    assert (order.challenge, order.until_s) == ("0123456789abcdef", 10.0)
    assert [one[0] for one in desk.broker.asked] == ["goal"]
    assert desk.fleet.stops == []
    assert desk.commander.machine("AGI").state == "RUNNING"


def row(desk: Desk) -> CommandRecord:
    """The newest row of the goal, as the history keeps it."""
    return [one for one in desk.records(CommandRecord) if one.kind == "goal"][-1]


async def test_a_goal_is_a_row_of_the_commands_with_answer_and_progress() -> None:
    desk = await sent(GoalWish("here", 5.0, 6.0))
    desk.clock.now += 0.5
    say(desk, "ACCEPTED")
    desk.clock.now += 4.0
    free(desk)
    say(desk, "REACHED")

    told = row(desk)
    steps = [one.state for one in desk.records(CommandEventRecord)]
    assert told.command_id == newest(desk).goal.goal_id
    assert (told.robot_id, told.state, told.requested_by) == ("AGI", "REACHED", "ana")
    assert told.goal == {"kind": "here", "x": 5.0, "y": 6.0, "aisle": None}
    assert steps == ["SENT", "DRIVING", "REACHED"]
    assert outcome_of(told) == "reached"


@pytest.mark.parametrize(
    ("result", "state", "outcome"),
    [("REFUSED", "REFUSED", "refused"), ("DROPPED", "CANCELLED", "cancelled")],
)
async def test_the_row_of_a_goal_says_how_it_ended(
    result: str, state: str, outcome: str
) -> None:
    desk = await sent()
    say(desk, result, "no_way")

    assert (row(desk).state, row(desk).reason) == (state, "no_way")
    assert outcome_of(row(desk)) == outcome


async def test_goals_of_an_earlier_run_are_closed_and_ours_are_not() -> None:
    desk = await sent()
    ours = row(desk)
    desk.parts.goals.close_earlier(
        [ours, replace(ours, command_id="01OLD")], desk.clock()
    )

    rows = {one.command_id: one for one in desk.records(CommandRecord)}
    assert (rows["01OLD"].state, outcome_of(rows["01OLD"])) == ("EXPIRED", "expired")
    assert rows[ours.command_id].state == "SENT"


async def test_a_stop_deletes_the_goal_and_the_robots_word_is_kept_beside_it() -> None:
    desk = await sent()
    say(desk, "ACCEPTED")

    await desk.commander.stop(["AGI"], "ben", desk.clock())

    assert (newest(desk).state, newest(desk).forgotten) == ("DELETED", None)
    assert "log.goal.held" in desk.sentences()
    say(desk, "DROPPED", "held")
    assert (newest(desk).state, newest(desk).forgotten) == ("DELETED", desk.clock())


async def test_a_stop_before_the_goal_left_keeps_it_back() -> None:
    desk = Desk()
    free(desk)
    desk.parts.goals.give("AGI", THERE, "ana", desk.clock())
    await desk.commander.stop(["AGI"], "ben", desk.clock())
    await settle()

    assert desk.fleet.goals == []


async def test_a_cancellation_names_the_goal_and_waits_for_the_robot() -> None:
    desk = await sent()
    say(desk, "ACCEPTED")
    desk.parts.goals.cancel("AGI", "ben", desk.clock())
    await settle()

    goal_id = newest(desk).goal.goal_id
    assert newest(desk).state == "CANCELLING"
    assert desk.fleet.goals[-1] == ("AGI", CancelOrder(goal_id))
    say(desk, "DROPPED", "cancelled")
    assert newest(desk).state == "CANCELLED"
