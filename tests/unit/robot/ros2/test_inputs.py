"""Algorithm 1 on a ROS 2 robot: the newest of each, in map, or named and unplaced."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.observations import (
    Battery,
    DetectionFrame,
    LaserScan,
    Navigation,
    Odometry,
    Unplaced,
)
from iveg.robot.ros2.reading import speed_of
from iveg.ros2 import messages as ros
from tests.unit.robot.ros2 import said
from tests.unit.robot.ros2.said import Bench, link, look, seen, tf

# --- odometry -----------------------------------------------------------------------


def test_odometry_is_moved_into_map() -> None:
    found = Bench().hear("odometry", said.odometry(2.0, 0.4, w=0.1)).only(Odometry)

    assert (found.pose.x, found.pose.y) == (12.0, 0.0)
    assert (found.twist.linear_x, found.twist.angular_z) == (0.4, 0.1)


def test_odometry_of_another_frame_of_the_robot_is_moved_to_base_link() -> None:
    bench = Bench().hear("tf_static", tf(link("footprint", "base_link", -0.2)))

    found = bench.hear("odometry", said.odometry(2.0, child="footprint")).only(Odometry)

    assert found.pose.x == pytest.approx(11.8)


@pytest.mark.parametrize(
    ("frame", "x", "faults"),
    [
        ("odom", 1.0, {}),
        ("odom", 2.0, {"pose_disagrees": "map → base_link"}),
        ("base_link", 1.0, {"pose_disagrees": "map → base_link"}),
        ("map", 1.0, {"pose_disagrees": "map → base_link"}),
    ],
)
def test_odometry_that_the_tree_contradicts_is_named(
    frame: str, x: float, faults: dict[str, str]
) -> None:
    bench = Bench().hear("tf", tf(link("odom", "base_link", 1.2)))
    header = ros.Header(said.stamp(), frame)

    bench.hear("odometry", replace(said.odometry(x), header=header)).tick()

    assert bench.faults() == faults


def test_the_first_data_wait_for_the_transforms_that_follow_them() -> None:
    """Localisation publishes map → odom later than the base publishes its own."""
    bench = Bench(tree=False, heard_for=0.0)
    bench.hear("odometry", said.odometry(2.0)).hear("scan", said.scan())
    bench.hear("tf", tf(link("odom", "base_link", 2.0)))
    early = bench.tick(0.1)

    bench.hear("tf", tf(link("map", "odom", 10.0)), 0.3)
    bench.hear("tf_static", tf(link("base_link", "laser", 0.3)), 0.4)
    placed, swept = bench.tick(0.6)

    assert early == []
    assert isinstance(placed, Odometry)
    assert isinstance(swept, LaserScan)
    assert bench.faults(0.6) == {}


def test_an_old_transform_is_named_with_its_age_and_places_nothing() -> None:
    bench = Bench().hear("odometry", said.odometry(after=2.1), 2.1)

    (found,) = bench.tick(2.1)

    assert isinstance(found, Unplaced)
    (fault,) = bench.inputs.input_faults.faults(said.MONO + 2.1)
    assert (fault.code, fault.about) == ("no_transform", "map → odom")
    assert fault.for_s == pytest.approx(2.1)
    assert bench.inputs.pose() is None


def test_silence_of_odometry_is_named_from_the_start() -> None:
    bench = Bench()
    bench.tick(0.0)
    bench.tick(1.6)

    assert bench.faults(1.6) == {"no_data": "/odom"}
    assert speed_of(bench.inputs.input_faults.faults(said.MONO + 1.6)) == (
        0.5,
        "no_data",
    )


# --- numbers that cannot be meant ---------------------------------------------------


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (said.odometry(math.nan), "not_a_number"),
        (said.odometry(v=math.inf), "not_a_number"),
        (said.odometry(v=1e6), "absurd"),
        (said.odometry(1e9), "not_a_number"),
    ],
)
def test_odometry_that_cannot_be_is_named_and_slows(
    message: ros.Odometry, code: str
) -> None:
    bench = Bench()

    assert bench.hear("odometry", message).tick() == []
    assert bench.faults() == {code: "/odom"}
    assert speed_of(bench.inputs.input_faults.faults(said.MONO)) == (0.5, code)


def test_a_clock_that_was_set_back_is_believed_and_one_that_stumbles_is_not() -> None:
    bench = Bench().hear("odometry", said.odometry(after=0.1))
    bench.tick()
    stumbled = bench.hear("odometry", said.odometry(after=0.05)).tick()
    hour = -3600.0
    unplaced = bench.hear("odometry", said.odometry(after=hour)).tick()
    bench.hear("tf", tf(link("map", "odom", 10.0, after=hour + 0.2)))
    bench.hear("odometry", said.odometry(1.0, after=hour + 0.2))

    (found,) = bench.tick()

    assert stumbled == []
    assert [type(one) for one in unplaced] == [Unplaced]
    assert isinstance(found, Odometry)
    assert bench.faults()["time_back"] == "/odom"


def test_bytes_of_another_layout_are_named() -> None:
    bench = Bench()
    bench.inputs.receive("odometry", [b"\0\1\0\0short"], said.MONO)

    assert bench.tick() == []
    assert bench.faults() == {"unreadable": "/odom"}


# --- the laser ----------------------------------------------------------------------


def test_a_scan_is_placed_by_where_the_laser_was_when_it_swept() -> None:
    """The robot moved on by 0.1 m between the sweep and its odometry."""
    bench = Bench()
    bench.hear("tf", tf(link("odom", "base_link", 1.0)))
    bench.hear("tf", tf(link("odom", "base_link", 1.2, after=0.2)))
    bench.hear("odometry", said.odometry(1.2, after=0.2))
    bench.hear("scan", said.scan(after=0.1))

    found = bench.only(LaserScan, 0.2)

    assert found.mount.x == pytest.approx(0.3 - 0.1)


def test_a_laser_upside_down_turns_the_other_way() -> None:
    bench = Bench()
    rolled = ros.Transform(ros.Vector3(0.3), ros.Quaternion(1.0, 0.0, 0.0, 0.0))
    header = ros.Header(said.stamp(), "base_link")
    bench.hear("tf_static", tf(ros.TransformStamped(header, "laser", rolled)))
    bench.hear("odometry", said.odometry()).hear("scan", said.scan())

    found = bench.only(LaserScan)

    assert (found.angle_min, found.angle_increment) == (0.5, -0.5)


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (said.scan(()), "no_returns"),
        (said.scan((math.nan,) * 3), "no_returns"),
        (said.scan((math.inf,) * 3), "no_returns"),
        (said.scan((0.0, 0.05, 25.0)), "no_returns"),
        (replace(said.scan(), angle_increment=0.0), "bad_range"),
        (replace(said.scan(), angle_min=math.nan), "not_a_number"),
        (replace(said.scan(), range_min=20.0, range_max=0.1), "bad_range"),
        (replace(said.scan(), range_max=math.nan), "bad_range"),
        (said.scan(np.zeros(100_000).tolist()), "too_many_beams"),
        (said.scan(frame="elsewhere"), "no_transform"),
    ],
)
def test_a_scan_that_cannot_be_used_is_named_and_slows(
    message: ros.LaserScan, code: str
) -> None:
    bench = Bench().hear("odometry", said.odometry()).hear("scan", message)

    found = bench.tick()

    assert not [one for one in found if isinstance(one, LaserScan)]
    assert code in bench.faults()
    assert speed_of(bench.inputs.input_faults.faults(said.MONO))[0] == 0.5


def test_a_laser_that_repeats_its_last_scan_is_a_silent_one() -> None:
    bench = Bench().hear("odometry", said.odometry()).hear("scan", said.scan())
    bench.tick()

    for after in (0.5, 1.0, 1.5):
        bench.hear("odometry", said.odometry(after=after), after)
        bench.hear("tf", tf(link("map", "odom", 10.0, after=after)))
        bench.hear("scan", said.scan(), after).tick(after)

    assert bench.faults(1.5) == {"no_data": "/scan"}


def test_only_a_beam_that_did_not_come_back_found_nothing() -> None:
    message = said.scan((math.nan, -1.0, -math.inf, -0.0, math.inf, 1e7, 2.0))
    message = replace(message, range_min=0.0)
    bench = Bench().hear("odometry", said.odometry()).hear("scan", message)

    found = bench.only(LaserScan)

    unknown, nothing = 0.0, math.inf
    assert found.ranges.tolist() == [*[unknown] * 4, nothing, nothing, 2.0]
    assert found.returns().tolist() == [False] * 6 + [True]


# --- detections ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "bad", [seen(score=math.nan), seen(score=1.5), seen(x=math.nan), seen("()")]
)
def test_a_detection_that_cannot_be_is_counted_beside_the_others(
    bad: ros.Detection3D,
) -> None:
    bench = Bench().hear("tf", tf(link("odom", "base_link")))

    found = bench.hear("detections_3d", look(seen(), bad)).only(DetectionFrame)

    assert (len(found.detections), len(found.unread)) == (1, 1)


# --- path and battery ---------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 1024, 2045, 3069])
def test_a_plan_is_moved_into_map_and_no_pose_of_it_is_told_twice(count: int) -> None:
    header = ros.Header(said.stamp(), "odom")
    poses = tuple(
        ros.PoseStamped(header, ros.Pose(ros.Point(float(x)))) for x in range(count)
    )

    found = Bench().hear("path", ros.Path(header, poses)).only(Navigation)

    assert len(set(found.path)) == len(found.path) <= 1024
    assert found.path[0] == (10.0, 0.0)
    assert found.path[-1] == found.goal == (count + 9.0, 0.0)


@pytest.mark.parametrize(
    ("told", "share"), [(0.8, 0.8), (80.0, 0.8), (math.nan, None), (-1.0, None)]
)
def test_a_battery_is_read_as_a_share(told: float, share: float | None) -> None:
    bench = Bench().hear("battery", ros.BatteryState(percentage=told, voltage=25.5))

    battery = bench.only(Battery)

    assert battery.percentage == (None if share is None else pytest.approx(share))
    assert battery.voltage == 25.5


def test_a_foreign_frame_cannot_say_what_orion_refuses() -> None:
    bench = Bench(tree=False).hear("tf_static", tf(link("a<b>;('c')", "odom")))

    bench.hear("odometry", said.odometry()).tick()

    assert bench.faults() == {"no_transform": "map → abc"}
