"""Boxes without a frame and in unknown ones, from the wire to alerts and limits."""

from dataclasses import replace

from iveg.domain.observations import Detection
from tests.builders import detection
from tests.unit.vital.desk import Desk, conditions_of

ALERT = "alert.frame_not_named"


def unlabelled(x: float, class_id: str = "farmer") -> Detection:
    return replace(detection(class_id, x), frame_id=None)


def parked(*robots: str) -> Desk:
    """AGI and AGII stand ten metres apart, both see nothing."""
    desk = Desk(robots or ("AGI", "AGII"))
    for number, robot_id in enumerate(robots or ("AGI", "AGII")):
        desk.drive(robot_id, 10.0 * number, linear=0.0)
        desk.look(robot_id)
    return desk


def factors(desk: Desk) -> list[float]:
    return [one.speed_factor for one in desk.evaluator.speed_limits.values()]


async def test_a_robot_that_names_no_frame_is_a_notice_as_long_as_it_names_none() -> (
    None
):
    desk = parked()
    desk.look("AGI", unlabelled(4.0))
    await desk.wait(0.1)
    (told,) = (
        one.condition
        for one in desk.evaluator.alerts.waiting
        if one.condition.key == ALERT
    )
    assert (told.priority, told.slots) == ("P3", {"robot": "AGI"})
    desk.look("AGI")
    await desk.wait(0.1)
    assert ALERT in conditions_of(desk)
    desk.look("AGI", detection(x=4.0))
    await desk.wait(0.1)
    assert ALERT not in conditions_of(desk)


def test_a_person_in_an_unknown_frame_slows_who_is_near_for_a_second() -> None:
    desk = parked("AGI", "AGII")

    desk.look("AGI", replace(detection(x=4.0), frame_id="odom"))
    assert factors(desk) == [0.5, 0.5]

    desk.clock.now = 1.01
    for robot_id, x in (("AGI", 0.0), ("AGII", 10.0)):
        desk.drive(robot_id, x, linear=0.0)
        desk.look(robot_id, detection(x=-90.0))
    assert factors(desk) == [1.0, 1.0]


def test_a_robot_that_invents_frames_fills_neither_the_log_nor_the_room_of_others() -> (
    None
):
    desk = parked()
    for number in range(300):
        desk.clock.now += 0.05
        desk.look("AGI", replace(detection(x=4.0), frame_id=f"frame-{number}"))

    desk.look("AGII", replace(detection(x=4.0), frame_id="odom"))

    lines = [one for one in desk.event_log.lines if one.key == "log.unknown_frame"]
    assert [one.robot_id for one in lines] == ["AGI"] * 20 + ["AGII"]
    assert desk.world.counters["detections.unknown_frame"] == 301
