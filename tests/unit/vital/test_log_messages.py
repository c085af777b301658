"""Which sentence the log takes, and what fills its holes."""

from dataclasses import replace

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


def slows_for(desk: Desk, x: float, by: str = "AGII") -> None:
    """One sees a farmer at ``x``, and AGI, at 0, says that it slows for them."""
    desk.drive("AGI", 0.0)
    desk.look(by, detection("farmer", x))
    (person,) = desk.evaluator.people.known.values()
    desk.report("AGI", factor=0.5, reason="person", decision_id=person.decision_id)


def test_a_robot_that_is_far_ahead_of_our_decision_is_told_without_its_cause() -> None:
    desk = Desk()

    slows_for(desk, 4.0)

    key, slots = told(desk)
    assert key == "log.speed_down.person"
    assert "distance" not in slots


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


def test_a_line_of_a_robot_ahead_opens_our_decision_when_there_is_one() -> None:
    desk = Desk()

    slows_for(desk, 1.0)

    (entry,) = desk.evaluator.entries
    line = [one for one in desk.event_log.lines if one.robot_id == "AGI"][-1]
    assert line.decision_id == entry.decision_id
    # A ring that has not grown is not mentioned.
    assert {"radius", "unseen"}.isdisjoint(told(desk)[1])


def test_a_peer_is_told_by_its_name_and_no_alert_means_no_other_peer() -> None:
    desk = Desk()
    desk.drive("AGI", 0.0)
    desk.drive("AGII", 1.5)
    desk.look("AGI")
    desk.look("AGII")

    slow = safety_report(speed_factor=0.5, reason="robot", cause="AGII")
    desk.hear(replace(slow, origin=desk.next_origin()))
    key, slots = told(desk)
    assert (key, slots["person"]) == ("log.speed_down.robot", "AGII")

    slower = safety_report(speed_factor=0.4, reason="person")
    desk.hear(replace(slower, origin=desk.next_origin()))
    assert "person" not in told(desk)[1]


def test_nobody_is_unseen_by_the_robot_that_saw_them() -> None:
    desk = Desk(greenhouse=HEDGE)

    slows_for(desk, 1.5, by="AGI")

    assert told(desk)[0] == "log.speed_down.person"


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
