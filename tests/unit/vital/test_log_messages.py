"""Which sentence the log takes, and what fills its holes."""

from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.rule.clear import ClearCondition
from iveg.vital.evidence import speed_line
from tests.builders import detection, safety_report
from tests.unit.vital.desk import Desk

HEDGE = Greenhouse(
    "hedge", Rectangle(-100, -100, 100, 100), rows=(Rectangle(2.9, -50, 3.1, 50),)
)


def told(desk: Desk) -> tuple[str, dict[str, object]]:
    """The newest line about AGI's speed."""
    lines = [one for one in desk.event_log.lines if one.kind == "speed"]
    line = [one for one in lines if one.robot_id == "AGI"][-1]
    return line.key, dict(line.slots)


def test_the_line_says_that_another_robot_saw_whom_this_one_cannot_see() -> None:
    desk = Desk(greenhouse=HEDGE)
    desk.drive("AGI", 2.0)
    desk.look("AGII", detection("farmer", 3.5))
    (entry,) = desk.evaluator.entries

    desk.report("AGI", factor=0.5, reason="person", decision_id=entry.decision_id)
    desk.loop.step([], desk.clock())

    key, slots = told(desk)
    assert key == "log.speed_down.person_nlos"
    assert (slots["observer"], slots["distance"]) == ("AGII", 1.5)


def test_13_9_a_slow_down_far_from_anybody_says_how_the_ring_had_grown() -> None:
    desk = Desk()
    desk.drive("AGI", 0.0)
    desk.look("AGII", detection("farmer", 5.0))
    desk.clock.now += 2.5
    desk.drive("AGI", 0.0)
    desk.drive("AGII", 50.0)
    desk.evaluator.age(desk.clock())
    desk.evaluator.tick(desk.clock())
    (entry,) = desk.evaluator.entries

    desk.report("AGI", factor=0.5, reason="person", decision_id=entry.decision_id)

    _, slots = told(desk)
    assert slots["distance"] == 5.0
    assert slots["radius"] == 5.49
    assert slots["unseen"] == 2.5


def test_a_slow_down_for_a_camera_that_is_not_read_names_it() -> None:
    report = safety_report(speed_factor=0.5, reason="stale", cause="AGII")
    lacks = ClearCondition("doubt", "AGII"), ClearCondition("detector", "AGII")

    line = speed_line(report, None, lacks)

    assert (line.key, line.slots["observer"]) == ("log.speed_down.detector", "AGII")
