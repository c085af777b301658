"""The age of what a ROS 2 robot measured, on the robot and at iVeg."""

import pytest

from iveg.domain.limits import LIMITS
from iveg.lab.experiment.virtual import read_direct
from iveg.robot.ros2.reading import speed_of
from iveg.robot.uplink import Sender, Uplink
from tests.fakes.echo import Echo
from tests.unit.robot.ros2 import said
from tests.unit.robot.ros2.said import Bench, link, look, seen, tf
from tests.unit.vital.desk import Desk

PICTURES = "detections_3d"


@pytest.mark.parametrize(
    ("stamp", "age_s", "faults"),
    [
        (1.9, 0.1, {}),
        (3.0, 0.0, {}),
        (-2.0, 4.0, {"data_late": "/detections_3d"}),
        (-9.0, 10.0, dict.fromkeys(("clock_off", "data_late"), "/detections_3d")),
    ],
)
def test_a_picture_is_as_old_as_its_stamp_and_a_late_detector_is_named_and_slows(
    stamp: float, age_s: float, faults: dict[str, str]
) -> None:
    bench = Bench().hear(PICTURES, look(after=stamp), 2.0)

    assert bench.ages(2.0) == [age_s]
    assert bench.faults(2.0) == faults
    factor, _ = speed_of(bench.inputs.input_faults.faults(said.MONO + 2.0))
    assert factor == (0.5 if faults else 1.0)


def test_a_simulators_picture_is_older_by_the_stamp_of_the_newest_odometry() -> None:
    bench = Bench(sim_time=True).hear("odometry", said.odometry(after=0.4), 100.0)
    assert bench.hear(PICTURES, look(after=0.1)).ages(100.0) == [0.0, 0.3]


def test_no_stamp_makes_a_pose_or_a_sweep_older() -> None:
    bench = Bench().hear("odometry", said.odometry(after=0.2), 0.25)
    assert bench.hear("scan", said.scan(after=0.1)).ages(3.0) == [0.0, 0.0]
    assert {fault.code for fault in bench.inputs.input_faults.faults(said.MONO + 3.0)}


def test_iveg_grows_a_zone_by_the_age_of_a_slow_detectors_pictures() -> None:
    late_s, desk, bench, echo = 4.0, Desk(), Bench(), Echo()

    def take(topic: str, payload: bytes) -> None:
        desk.loop.step([*read_direct(topic, payload, desk.clock())], desk.clock())

    uplink = Uplink(Sender("AGI", "iveg", "b"), take, echo.authors.echoes)
    for step in range(1, 61):
        desk.clock.now = after = step / 10
        for feedback in desk.fleet.told[-1:]:
            echo.note(feedback.origin, desk.clock().mono)
        bench.hear("tf", tf(link("map", "odom", 10.0, after=after)), after)
        bench.hear("tf", tf(link("odom", "base_link", after=after)), after)
        bench.hear("odometry", said.odometry(v=0.0, after=after), after)
        if after > late_s:
            picture = look(seen(after=after - late_s), after=after - late_s)
            bench.hear(PICTURES, picture, after)
        for sensed in bench.sense(after):
            uplink.send(sensed.observation, desk.clock(), sensed.age_s)
        desk.drive("AGII", 15.0, linear=0.0)
        desk.look("AGII")

    evaluator, now = desk.evaluator, desk.clock()
    (known,) = evaluator.people.known.values()
    ((_, radius_m),) = evaluator.people.zone_radii(known, evaluator.rule, now)
    assert late_s <= known.age_s(now) <= late_s + 0.2
    assert radius_m == LIMITS.zone_most_m
    assert evaluator.speed_limits["AGII"].reason == "person"
    assert bench.faults(after) == {"data_late": "/detections_3d"}
