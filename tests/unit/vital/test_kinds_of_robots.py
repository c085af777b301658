"""Live or recorded: what is told, and whose messages count."""

from dataclasses import replace

from iveg.domain.detection_rule import RECOVERED
from iveg.domain.observations import CommandAnswer
from tests.builders import hold, odometry, safety_report
from tests.unit.vital.desk import Desk


def alerts(desk: Desk) -> list[tuple[str, str, object]]:
    """Priority, key and who is named of all that wait."""
    found = [one.condition for one in desk.evaluator.alerts.waiting]
    return [
        (one.priority, one.key, one.slots.get("robots", one.robot_id)) for one in found
    ]


async def test_a_replay_of_a_live_robot_is_told_and_confirms_no_stop() -> None:
    desk = Desk(("AGI",))
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    hold_id = desk.commander.machine("AGI").hold_id
    played = replace(desk.next_origin(), replay="AGI")
    state = desk.commander.machine("AGI").state

    desk.hear(CommandAnswer("AGI", played, hold_id, "LATCHED"))
    desk.hear(safety_report("AGI", hold(hold_id or ""), origin=played))
    desk.hear(odometry("AGI", 3.0, origin=played))
    await desk.wait(0.1)

    assert desk.commander.machine("AGI").state == state
    assert desk.world.robot("AGI").odometry is None
    assert ("P2", "alert.replay_refused", "AGI") in alerts(desk)


async def test_a_live_robot_that_the_fleet_calls_a_recording_is_told_at_once() -> None:
    desk = Desk(("AGI", "D1:recording"))

    desk.report("D1", reason="clear", factor=1.0)
    await desk.wait(0.1)

    assert ("P1", "alert.recording_is_live", "D1") in alerts(desk)
    assert "D1" in [one.robot_id for one in desk.world.live_robots()]


async def test_a_rule_that_was_recovered_is_told_until_somebody_makes_another() -> None:
    desk = Desk(("AGI",))
    desk.evaluator.rule = replace(desk.evaluator.rule, author=RECOVERED)
    await desk.wait(0.1)
    at_first = alerts(desk)
    desk.evaluator.rule = replace(desk.evaluator.rule, author="ana")
    await desk.wait(0.1)

    assert at_first == [("P2", "alert.rule_recovered", None)]
    assert alerts(desk) == []
