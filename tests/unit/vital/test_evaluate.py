"""The rule at work: feedback, log, alerts and the heartbeat of the fleet."""

from dataclasses import replace

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.observations import Origin
from iveg.domain.parameters import ByClass
from iveg.domain.records import (
    AlertRecord,
    DecisionRecord,
    DetectionRecord,
    OdometryRecord,
)
from tests.builders import detection, detection_frame
from tests.fakes.records import alert_record
from tests.unit.vital.desk import Desk, conditions_of


def watched(desk: Desk) -> Desk:
    """Both robots are there, look, and report that they drive."""
    desk.drive("AGI", 0.0)
    desk.drive("AGII", 50.0)
    desk.look("AGI")
    desk.look("AGII")
    desk.report("AGI", factor=1.0, reason="clear", linear=0.5)
    desk.report("AGII", factor=1.0, reason="clear", linear=0.5)
    return desk


def meet(desk: Desk, x: float = 1.5) -> None:
    """AGII sees a farmer ``x`` metres before AGI."""
    desk.look("AGII", detection("farmer", x))


def test_13_13_a_decision_remembers_where_the_robots_were() -> None:
    desk = watched(Desk())

    meet(desk)

    places = desk.records(DecisionRecord)[-1].rule_parameters["places"]
    assert {one["robot_id"] for one in places} == {"AGI", "AGII"}


def test_feedback_tells_how_people_go_on_for_as_long_as_they_are_seen() -> None:
    desk = watched(Desk())
    meet(desk)
    [told] = desk.fleet.told[-1].alerts
    assert (told.velocity, desk.fleet.told[-1].foresight) == ((0.0, 0.0), True)

    desk.clock.now += 1.5
    desk.drive("AGI", 0.0)
    desk.evaluator.rule = replace(desk.evaluator.rule, foresight=False)
    desk.evaluator.publish(desk.clock())
    [told] = desk.fleet.told[-1].alerts
    assert (told.velocity, desk.fleet.told[-1].foresight) == (None, False)


def test_a_sighting_is_told_to_the_fleet_at_once() -> None:
    desk = watched(Desk())
    desk.fleet.told.clear()

    meet(desk)

    told = {one.robot_id: one for one in desk.fleet.told}
    assert set(told) == {"AGI", "AGII"}
    assert told["AGI"].speed_limits["AGI"].reason == "person"
    assert told["AGII"].alert is not None
    assert told["AGII"].alert.class_id == "farmer"
    assert told["AGII"].alert.radius_m == pytest.approx(2.0)
    assert told["AGI"].alert is None
    assert len(told["AGI"].alerts) == 1


def test_feedback_has_the_rule_and_where_iveg_believes_each_robot_to_be() -> None:
    desk = watched(Desk())
    desk.evaluator.rule = DetectionRule(radius_m=ByClass(2.0, {"robot": 3.0}))
    meet(desk)

    newest = {one.robot_id: one for one in desk.fleet.told}
    assert newest["AGII"].pose is not None
    assert newest["AGII"].pose.x == 50.0
    assert newest["AGII"].pose_stamp is not None
    assert newest["AGI"].rule == {"radius_m": {"person": 2.0, "robot": 3.0}}


def test_feedback_says_which_reports_were_seen_and_how_far_orion_is_behind() -> None:
    desk = watched(Desk())
    desk.report("AGI", factor=0.5, reason="stale")
    seen = desk.seq
    desk.health_monitor.probe.sent(Origin("iveg-boot", 1), desk.clock())
    desk.clock.now += 7.0

    desk.evaluator.publish(desk.clock())

    assert [one.backlog_s for one in desk.fleet.told[-2:]] == [7.0, 7.0]
    assert [one.seen["AGI"] for one in desk.fleet.told[-2:]] == [seen, seen]


def test_another_confident_object_is_told_as_a_stamp_alone() -> None:
    desk = watched(Desk())
    desk.look("AGII", detection("crate", 9.0))
    desk.evaluator.publish(desk.clock())

    alert = next(one for one in desk.fleet.told[::-1] if one.robot_id == "AGII").alert
    assert alert is not None
    assert (alert.class_, alert.position) == (None, None)
    assert alert.stamp


def test_a_decision_is_written_down_with_its_feedback() -> None:
    desk = watched(Desk())

    meet(desk)

    newest = desk.records(DecisionRecord)[-1]
    assert (newest.robot_id, newest.observer) == ("AGI", "AGII")
    assert newest.feedback_at is not None
    assert newest.rule_parameters["threshold"] == 0.8
    verdicts = {one["link"]: one["verdict"] for one in newest.links}
    assert verdicts["feedback"] == "ok"


def test_what_the_robot_applies_and_shows_completes_the_decision() -> None:
    desk = watched(Desk())
    meet(desk)
    speed_limit = desk.evaluator.speed_limits["AGI"]

    desk.report(
        "AGI",
        factor=0.5,
        reason="person",
        decision_id=speed_limit.decision_id,
        linear=0.2,
    )
    desk.drive("AGI", 0.0, linear=0.2)

    decision = desk.evaluator.decisions.get(speed_limit.decision_id or "")
    assert decision is not None
    assert decision.applied is not None
    assert decision.speed_after == 0.2


async def test_the_end_of_a_crossing_ends_its_decision() -> None:
    desk = watched(Desk())
    meet(desk)
    for tenth in range(30):
        await desk.wait(0.1)
        desk.drive("AGI", 0.0)
        desk.drive("AGII", 50.0)
        desk.look("AGI")
        desk.look("AGII", detection("farmer", 1.5 + 0.1 * tenth))

    assert list(desk.evaluator.decisions.open) == []
    newest = desk.records(DecisionRecord)[-1]
    assert newest.ended_at is not None


def stored_verdicts(desk: Desk) -> set[str]:
    """Verdicts of the newest row of the newest decision."""
    newest = desk.records(DecisionRecord)[-1]
    return {one["verdict"] for one in newest.links}


async def drive_on(desk: Desk) -> None:
    """AGI drives on at 0.8 m/s and is heard; it reports nothing."""
    for number in range(25):
        desk.drive("AGI", 0.08 * number, linear=0.8)
        meet(desk)
        await desk.wait(0.1)


async def test_a_robot_that_does_not_slow_is_a_grave_alert_and_stored_as_missing() -> (
    None
):
    desk = watched(Desk())
    meet(desk)
    assert "open" in stored_verdicts(desk)

    await drive_on(desk)

    assert "alert.person_not_slowing" in conditions_of(desk)
    assert "log.alert.raised" in desk.sentences()
    assert desk.evaluator.decisions.open
    assert stored_verdicts(desk) == {"ok", "missing"}


def test_a_decision_that_is_open_when_iveg_goes_away_says_so() -> None:
    desk = watched(Desk())
    meet(desk)

    desk.evaluator.leave(desk.clock())

    newest = desk.records(DecisionRecord)[-1]
    assert newest.ended_at == desk.clock().wall
    assert stored_verdicts(desk) == {"ok", "unknown"}


def test_what_a_crash_left_open_is_closed_and_says_that_nobody_knows() -> None:
    crashed, desk = watched(Desk()), Desk()
    meet(crashed)
    left = crashed.records(DecisionRecord)[-1]

    desk.evaluator.close_earlier([left], [alert_record()], desk.clock())

    (closed,), (cleared,) = desk.records(DecisionRecord), desk.records(AlertRecord)
    assert closed.decision_id == left.decision_id
    assert closed.ended_at == cleared.cleared_at == desk.clock().wall
    assert stored_verdicts(desk) == {"ok", "unknown"}
    assert closed.links[-1]["link"] == "interrupted"


async def test_what_this_run_has_open_is_left_alone() -> None:
    desk = watched(Desk())
    meet(desk)
    await drive_on(desk)
    decisions, alerts = desk.records(DecisionRecord), desk.records(AlertRecord)
    before = len(desk.sink.records)

    desk.evaluator.close_earlier(decisions, alerts, desk.clock())

    assert alerts
    assert len(desk.sink.records) == before


def test_a_speed_change_is_told_with_who_saw_whom() -> None:
    desk = watched(Desk())
    meet(desk)
    speed_limit = desk.evaluator.speed_limits["AGI"]

    desk.report("AGI", factor=0.5, reason="person", decision_id=speed_limit.decision_id)

    line = desk.event_log.lines[-1]
    slots = line.slots
    assert (line.key, line.decision_id) == (
        "log.speed_down.person",
        speed_limit.decision_id,
    )
    assert (slots["observer"], slots["distance"]) == ("AGII", 1.5)
    # A ring that has not grown is not mentioned.
    assert {"radius", "unseen"}.isdisjoint(slots)


@pytest.mark.parametrize(
    ("name", "boxes", "key"),
    [("farmer", 1, "log.detection"), ("thing-{}-{}", 9, "log.detection_unmapped")],
)
def test_a_long_sighting_or_ever_new_things_are_one_line_and_two_rows_a_second(
    name: str, boxes: int, key: str
) -> None:
    desk = watched(Desk())
    for number in range(50):
        desk.clock.now = round(desk.clock.now + 0.1, 6)
        names = (name.format(number, box) for box in range(boxes))
        desk.look("AGII", *(detection(one, 80.0) for one in names))

    assert desk.sentences().count(key) == 1
    assert len(desk.records(DetectionRecord)) == 10


@pytest.mark.parametrize(
    ("class_id", "probability", "key"),
    [("farmer", 0.6, "log.detection_faint"), ("crate", 0.9, "log.detection_unmapped")],
)
def test_faint_and_unmapped_detections_are_never_silently_ignored(
    class_id: str, probability: float, key: str
) -> None:
    desk = watched(Desk())

    desk.look("AGII", detection(class_id, 80.0, probability=probability))

    assert desk.sentences()[-1] == key


def test_a_person_beyond_the_walls_slows_who_saw_them_and_is_told_as_doubtful() -> None:
    desk = watched(Desk())

    desk.look("AGI", detection("farmer", 150.0))

    assert "log.detection_doubtful" in desk.sentences()
    assert desk.evaluator.speed_limits["AGI"].reason == "person"
    alert = desk.fleet.told[-1].alerts[0]
    assert alert.position is not None
    assert alert.position[:2] == (0.0, 0.0)
    assert alert.radius_m == 8.0


def test_a_possible_person_is_told_as_such_where_the_rule_counts_them() -> None:
    desk = watched(Desk())
    desk.evaluator.rule = DetectionRule(possible_people=True)
    # Faint looks at one spot are told once; the possible one is another line.
    for confidence in (0.7, 0.68, 0.75):
        desk.clock.now += 0.3
        desk.look("AGI", detection("farmer", 5.0, probability=confidence))

    assert desk.sentences().count("log.detection_faint") == 1
    assert desk.sentences().count("log.detection_possible") == 1


async def test_two_poses_a_second_are_kept_and_each_change_of_what_is_applied() -> None:
    desk = watched(Desk())
    for _ in range(100):
        await desk.wait(0.05)
        desk.drive("AGII", 50.0)
    before = [one for one in desk.records(OdometryRecord) if one.robot_id == "AGII"]
    desk.report("AGII", factor=0.5, reason="stale")
    desk.drive("AGII", 50.0)

    newest = desk.records(OdometryRecord)[-1]
    assert 10 <= len(before) <= 13
    assert (newest.robot_id, newest.applied_factor) == ("AGII", 0.5)


def test_a_late_look_still_protects_whom_it_saw_and_leaves_the_page_alone() -> None:
    desk = watched(Desk())
    late = desk.next_origin()
    desk.look("AGII")

    desk.hear(detection_frame("AGII", detection("farmer", 1.0), origin=late))
    desk.loop.step([], desk.clock())
    desk.clock.now = 0.1
    desk.loop.step([], desk.clock())

    assert desk.evaluator.speed_limits["AGI"].reason == "person"
    assert desk.evaluator.tracking.placed["AGII"] == []


def test_what_orion_kept_of_yesterday_makes_nobody_appear() -> None:
    desk = watched(Desk())
    kept = Origin("yesterday", 5, None, None)

    desk.hear(
        detection_frame("AGII", detection("farmer", 1.0), origin=kept),
        is_query_answer=True,
    )

    assert desk.evaluator.people.known == {}
