"""Which sentence the log takes, and what fills its holes."""

from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import SafetyReport
from iveg.domain.rule.premises import Missing
from iveg.pipeline.log_messages import speed_line
from tests.builders import detection, safety_report
from tests.unit.pipeline.desk import Desk

HEDGE = Greenhouse(
    "hedge", Rectangle(-100, -100, 100, 100), rows=(Rectangle(2.9, -50, 3.1, 50),)
)


def told(desk: Desk) -> tuple[str, dict[str, object]]:
    """The newest line about AGI's speed."""
    lines = [one for one in desk.event_log.lines if one.kind == "speed"]
    line = [one for one in lines if one.robot_id == "AGI"][-1]
    return line.key, dict(line.slots)


def means_agii(desk: Desk) -> SafetyReport:
    """AGI slows for its peer."""
    return safety_report(
        "AGI",
        speed_factor=0.5,
        reason="robot",
        cause="AGII",
        origin=desk.next_origin(),
    )


def test_a_robot_ahead_of_our_decision_is_told_with_whom_it_means() -> None:
    desk = Desk(greenhouse=HEDGE)
    desk.drive("AGI", 0.0)
    desk.look("AGII", detection("farmer", 4.0))
    (person,) = desk.evaluator.people.known.values()

    desk.report("AGI", factor=0.5, reason="person", decision_id=person.decision_id)

    key, slots = told(desk)
    assert key == "log.speed_down.person_nlos"
    assert (slots["observer"], slots["distance"]) == ("AGII", 4.0)


def test_a_line_opens_no_decision_that_does_not_exist() -> None:
    desk = Desk(greenhouse=HEDGE)
    desk.drive("AGI", 0.0)
    desk.look("AGII", detection("farmer", 4.0))
    (person,) = desk.evaluator.people.known.values()

    desk.report("AGI", factor=0.5, reason="person", decision_id=person.decision_id)

    line = [one for one in desk.event_log.lines if one.robot_id == "AGI"][-1]
    assert line.decision_id is None


def test_a_line_of_a_robot_ahead_opens_our_decision_when_there_is_one() -> None:
    desk = Desk()
    desk.drive("AGI", 0.0)
    desk.look("AGII", detection("farmer", 1.0))
    (person,) = desk.evaluator.people.known.values()
    (crossing,) = desk.evaluator.crossings

    desk.report("AGI", factor=0.5, reason="person", decision_id=person.decision_id)

    line = [one for one in desk.event_log.lines if one.robot_id == "AGI"][-1]
    assert line.decision_id == crossing.decision_id


def test_nobody_is_unseen_by_the_robot_that_saw_them() -> None:
    desk = Desk(greenhouse=HEDGE)
    desk.drive("AGI", 0.0)
    desk.look("AGI", detection("farmer", 4.0))
    (person,) = desk.evaluator.people.known.values()

    desk.report("AGI", factor=0.5, reason="person", decision_id=person.decision_id)

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
    (crossing,) = desk.evaluator.crossings

    desk.report("AGI", factor=0.5, reason="person", decision_id=crossing.decision_id)

    _, slots = told(desk)
    assert slots["distance"] == 5.0
    assert slots["radius"] == 5.49
    assert slots["unseen"] == 2.5


def test_13_9_a_ring_that_has_not_grown_is_not_mentioned() -> None:
    desk = Desk()
    desk.drive("AGI", 0.0)
    desk.look("AGII", detection("farmer", 1.0))
    (crossing,) = desk.evaluator.crossings

    desk.report("AGI", factor=0.5, reason="person", decision_id=crossing.decision_id)

    assert {"radius", "unseen"}.isdisjoint(told(desk)[1])


def test_a_robot_that_means_a_peer_is_told_with_its_distance() -> None:
    desk = Desk()
    desk.drive("AGI", 0.0)
    desk.drive("AGII", 2.5)

    desk.hear(means_agii(desk))

    key, slots = told(desk)
    assert key == "log.speed_down.robot"
    assert (slots["person"], slots["distance"]) == ("AGII", 2.5)


def test_a_peer_without_a_pose_is_told_bare() -> None:
    desk = Desk()
    desk.drive("AGI", 0.0)

    desk.hear(means_agii(desk))

    assert "distance" not in told(desk)[1]


def test_a_reason_that_nobody_knows_anything_of_is_told_bare() -> None:
    desk = Desk()

    desk.report("AGI", factor=0.5, reason="person", decision_id="never-heard")

    key, slots = told(desk)
    assert key == "log.speed_down.person"
    assert "observer" not in slots


def test_somebody_near_a_robot_without_a_pose_is_told_bare() -> None:
    desk = Desk()
    desk.look("AGII", detection("farmer", 4.0))
    (person,) = desk.evaluator.people.known.values()

    desk.report("AGI", factor=0.5, reason="person", decision_id=person.decision_id)

    assert "observer" not in told(desk)[1]


def test_full_speed_again_has_one_sentence_whatever_it_was_for() -> None:
    desk = Desk()
    desk.report("AGI", factor=0.5, reason="stale")
    desk.report("AGI", factor=1.0, reason="clear")

    assert told(desk)[0] == "log.speed_up"


def test_a_slow_down_for_a_camera_that_is_not_read_names_it() -> None:
    report = safety_report(speed_factor=0.5, reason="stale", cause="AGII")
    lacks = Missing("doubt", "AGII"), Missing("detector", "AGII")

    line = speed_line(report, None, lacks)

    assert (line.key, line.slots["observer"]) == ("log.speed_down.detector", "AGII")


def test_a_slow_down_for_an_old_pose_is_told_as_old_data() -> None:
    report = safety_report(speed_factor=0.5, reason="stale", cause="AGI")

    line = speed_line(report, None, [Missing("pose", "AGI")])

    assert line.key == "log.speed_down.stale"
